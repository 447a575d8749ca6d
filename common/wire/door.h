/*
 * Private to the wire: the doorkeeper of a server's CURVE socket. A thread of its own answers ZeroMQ's question whether
 * a key may come in (ZAP, rfc.zeromq.org/spec/27), so that nobody waits while the server's thread is busy, and hears
 * which handshakes failed. At most one from wire_start to wire_stop: ZeroMQ frees by and by the address at which it
 * asks.
 */
#ifndef WEFT_WIRE_DOOR_H
#define WEFT_WIRE_DOOR_H

#include "base/error.h"
#include "wire/key_file.h"

struct door;

/* The names (ZeroMQ's User-Id) that messages from who came in carry: one of these, and its key (key_text). */
#define DOOR_WORKER "worker "
#define DOOR_WATCHER "watcher "

/* Starts before `guarded`, a socket that is borrowed until door_destroy, is bound. Moves both lists into the door. The
 * thread has the signal mask of the caller. NULL with *error filled if ZeroMQ or the system refuses; the lists are
 * untouched then. */
struct door *door_create(void *guarded, struct key_list *workers, struct key_list *watchers, struct error *error);

/* Nobody comes in any more. Accepts NULL in *door and sets it to NULL; to be called before the socket is closed. */
void door_destroy(struct door **door);

/* Logs who has been refused since the last call. On the caller's thread, because the log's display is its own. */
void door_tell(struct door *door);

#endif
