/*
 * Where running coordinators of this user are to be found on this machine.
 */
#ifndef WEFT_COORDINATOR_RUNTIME_H
#define WEFT_COORDINATOR_RUNTIME_H

#include "base/error.h"
#include "wire/socket.h"

/* The private endpoint of this process: ipc://FOLDER/PID.ipc, in $XDG_RUNTIME_DIR/weft or else /tmp/weft-UID, a folder
 * that only this user can enter; it is made if need be. What coordinators that are gone left there is removed. */
enum status runtime_endpoint(char endpoint[WIRE_ENDPOINT_BYTES], struct error *error);

/* Removes the file of an endpoint made by runtime_endpoint. */
void runtime_endpoint_remove(const char *endpoint);

/* Finds the coordinators of this user that run: those of its sessions, and if there is none, those of /tmp. Writes the
 * endpoints of the first `max` of them and returns how many there are. Another process that has the number of one that
 * was killed passes for it. */
size_t runtime_find(char (*endpoints)[WIRE_ENDPOINT_BYTES], size_t max);

#endif
