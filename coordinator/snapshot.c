#include "coordinator/snapshot.h"

const char *job_state_name(enum job_state state)
{
    static const char *const names[JOB_STATES] = {[JOB_WAITING] = "waiting",
                                                  [JOB_SURVEYING] = "surveying",
                                                  [JOB_RUNNING] = "running",
                                                  [JOB_DONE] = "done",
                                                  [JOB_FAILED] = "failed"};
    return names[state];
}

const char *stretch_state_name(enum stretch_state state)
{
    static const char *const names[STRETCH_STATES] = {
        [STRETCH_WAITING] = "waiting", [STRETCH_IN_WORK] = "in work", [STRETCH_DONE] = "done"};
    return names[state];
}

const char *worker_state_name(enum worker_state state)
{
    static const char *const names[WORKER_STATES] = {[WORKER_LOADING] = "loading",
                                                     [WORKER_WORKING] = "working",
                                                     [WORKER_IDLE] = "idle",
                                                     [WORKER_DRAINING] = "draining",
                                                     [WORKER_GONE] = "gone"};
    return names[state];
}

const char *worker_trouble_name(enum worker_trouble trouble)
{
    static const char *const names[WORKER_TROUBLES] = {[TROUBLE_LOST] = "lost",
                                                       [TROUBLE_SILENT] = "silent",
                                                       [TROUBLE_STUCK] = "stuck",
                                                       [TROUBLE_MISFIT] = "wrong result",
                                                       [TROUBLE_UNFIT] = "cannot load",
                                                       [TROUBLE_LIAR] = "wrong bytes"};
    return names[trouble];
}
