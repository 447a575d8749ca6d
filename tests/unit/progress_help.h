/* A farm at work, for the tests of its views. */
#ifndef WEFT_TESTS_UNIT_PROGRESS_HELP_H
#define WEFT_TESTS_UNIT_PROGRESS_HELP_H

#include <math.h>
#include <stddef.h>
#include <stdint.h>

#include "coordinator/snapshot.h"

enum { WORKERS = 100, JOBS = 5, STRETCHES = 5 };

/* A farm at work; tests change what they are about. */
struct farm {
    struct snapshot snapshot;
    struct job_snapshot jobs[JOBS];
    struct worker_snapshot workers[WORKERS];
    struct stretch_snapshot stretches[STRETCHES]; /* of the first job */
};

static inline struct job_snapshot job_of(const char *scene, const char *output, enum job_state state,
                                         uint32_t rows_done)
{
    return (struct job_snapshot){.scene = scene,
                                 .output = output,
                                 .state = state,
                                 .width = 1920,
                                 .height = 1080,
                                 .samples = 16,
                                 .samples_max = 16,
                                 .rmse = NAN,
                                 .rows_done = rows_done,
                                 .rows_in_work = 108,
                                 .rays = 36000000,
                                 .elapsed_seconds = 12.7,
                                 .remaining_seconds = 14.2};
}

static inline void farm_init(struct farm *farm, size_t jobs, size_t workers)
{
    static const char *const hosts[] = {"localhost", "münchen", "計算機-01", "render-node-17.cluster.example.org"};
    farm->snapshot = (struct snapshot){.elapsed_seconds = 13,
                                       .rays_per_second = 3.14e6,
                                       .rays = 36000000,
                                       .job_count = jobs,
                                       .worker_count = workers,
                                       .jobs = farm->jobs,
                                       .workers = farm->workers};
    for (size_t i = 0; i < jobs; i++)
        farm->jobs[i] = job_of("scenes/showcase.json", "showcase.png", JOB_WAITING, 0);
    farm->jobs[0].state = JOB_RUNNING;
    farm->jobs[0].rows_done = 486;
    farm->jobs[0].rmse = 0.00471;
    farm->stretches[0] = (struct stretch_snapshot){0, 432, STRETCH_DONE, 0};
    farm->stretches[1] = (struct stretch_snapshot){432, 54, STRETCH_IN_WORK, 1};
    farm->stretches[2] = (struct stretch_snapshot){486, 54, STRETCH_DONE, 0};
    farm->stretches[3] = (struct stretch_snapshot){540, 54, STRETCH_IN_WORK, 11};
    farm->stretches[4] = (struct stretch_snapshot){594, 486, STRETCH_WAITING, 0};
    farm->jobs[0].stretch_count = STRETCHES;
    farm->jobs[0].stretches = farm->stretches;
    for (size_t i = 0; i < workers; i++) {
        farm->workers[i] = (struct worker_snapshot){.number = (uint32_t)i + 1,
                                                    .host = hosts[i % 4],
                                                    .kernel = i % 2 ? "avx2" : "avx512",
                                                    .pid = 4000,
                                                    .threads = 1 + (uint32_t)i,
                                                    .state = i % 2 ? WORKER_IDLE : WORKER_WORKING,
                                                    .bands_held = 2,
                                                    .bands_done = 1 + (uint32_t)i,
                                                    .rows_done = 8,
                                                    .rays = 12,
                                                    .rays_per_second = 1.23456e7};
    }
}

static inline size_t count_lines(const char *text)
{
    size_t lines = 0;
    for (; *text; text++)
        lines += *text == '\n';
    return lines;
}

#endif
