/* What a session wants done, in order. */
#include <stdarg.h>
#include <stdio.h>

#include "base/memory.h"
#include "worker/session_private.h"

struct session_action *session_act(struct session *s, enum session_action_kind kind)
{
    s->actions = memory_grow(s->actions, &s->action_capacity, s->action_count + 1, sizeof *s->actions);
    struct session_action *action = &s->actions[s->action_count++];
    *action = (struct session_action){.kind = kind};
    return action;
}

bool session_take(struct session *s, struct session_action *action)
{
    if (s->action_at == s->action_count) {
        s->action_at = s->action_count = 0;
        return false;
    }
    *action = s->actions[s->action_at++];
    return true;
}

void session_send(struct session *s, struct message message)
{
    message.epoch = s->epoch;
    message_encode(&message, &session_act(s, SESSION_SEND)->bytes);
}

void session_say(struct session *s, const char *format, ...)
{
    struct session_action *action = session_act(s, SESSION_SAY);
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(action->text, sizeof action->text, format, arguments);
    va_end(arguments);
}

void session_drop_actions(struct session *s, uint32_t job)
{
    size_t kept = s->action_at;
    for (size_t i = s->action_at; i < s->action_count; i++) {
        const struct session_action *action = &s->actions[i];
        bool dropped = (action->kind == SESSION_LOAD || action->kind == SESSION_START) && action->job == job;
        if (!dropped)
            s->actions[kept++] = *action;
    }
    s->action_count = kept;
}
