/*
 * What the farm costs and how it scales: farm WEFT SCENE SMALL_SCENE [WIDTHxHEIGHT].
 *
 * `WEFT render` against the same core called in one process; both as processes of their own, from loading the scene
 * to the last pixel (and for weft, the PNG). Then SCENE with one to all cores' threads, and as many workers.
 */
#include "base/cpu.h"
#include "base/options.h"
#include "scene/load.h"
#include "tests/bench/bench.h"
#include "tests/bench/process.h"

enum { ROUNDS = 5 };

/* --- the two ways to render --------------------------------------------------------------------------------- */

struct task {
    const char *weft, *scene;
    uint32_t width, height;
    unsigned threads, workers;
    char output[64];
};

static struct process_cost render_by_farm(const struct task *task)
{
    char size[32], threads[16], workers[16];
    snprintf(size, sizeof size, "%ux%u", task->width, task->height);
    snprintf(threads, sizeof threads, "%u", task->threads);
    snprintf(workers, sizeof workers, "%u", task->workers);
    const char *argv[] = {task->weft, "render", task->scene, "--quiet", "--output", task->output, "--samples", "1",
                          "--size", size, "--threads", threads, "--workers", workers, NULL};
    struct process process = process_start(argv);
    return process_wait(&process, task->weft);
}

/* In a process of its own; its exit status is 0 if the scene could be loaded. */
static void load_and_render(const struct task *task)
{
    struct scene scene = {0};
    struct asset_set assets;
    struct error error;
    const char *name;
    asset_set_init_disk(&assets, task->scene, &name);
    if (scene_load(&scene, name, &assets, &error) != STATUS_OK) {
        fprintf(stderr, "farm: %s\n", error.text);
        _exit(STATUS_INPUT);
    }
    scene.width = task->width;
    scene.height = task->height;
    scene.samples = 1;
    free(scene_render(&scene, kernel_default(), NULL));
    _exit(0);
}

static struct process_cost render_in_process(const struct task *task)
{
    fflush(stdout);
    struct process process = {.start_us = clock_now_us(), .pid = fork()};
    if (process.pid == 0)
        load_and_render(task);
    return process_wait(&process, "the render in one process");
}

/* --- tables ------------------------------------------------------------------------------------------------- */

static int compare_doubles(const void *left, const void *right)
{
    double a = *(const double *)left, b = *(const double *)right;
    return a < b ? -1 : a > b;
}

/* Component by component. */
static struct process_cost median_cost(struct process_cost (*render)(const struct task *task), const struct task *task)
{
    double wall[ROUNDS], cpu[ROUNDS];
    for (int i = 0; i < ROUNDS; i++) {
        struct process_cost cost = render(task);
        wall[i] = cost.wall_seconds;
        cpu[i] = cost.cpu_seconds;
    }
    qsort(wall, ROUNDS, sizeof *wall, compare_doubles);
    qsort(cpu, ROUNDS, sizeof *cpu, compare_doubles);
    return (struct process_cost){.wall_seconds = wall[ROUNDS / 2], .cpu_seconds = cpu[ROUNDS / 2]};
}

static void print_overhead(const struct task *task)
{
    struct process_cost alone = median_cost(render_in_process, task), farm = median_cost(render_by_farm, task);
    printf("%s %ux%u\n  one process  wall %8.1f ms  CPU %8.1f ms\n  weft render  wall %8.1f ms  CPU %8.1f ms\n"
           "  the farm's   wall %8.1f ms  CPU %8.1f ms (%.1f %%)\n",
           task->scene, task->width, task->height, 1e3 * alone.wall_seconds, 1e3 * alone.cpu_seconds,
           1e3 * farm.wall_seconds, 1e3 * farm.cpu_seconds, 1e3 * (farm.wall_seconds - alone.wall_seconds),
           1e3 * (farm.cpu_seconds - alone.cpu_seconds),
           100 * (farm.cpu_seconds - alone.cpu_seconds) / alone.cpu_seconds);
    fflush(stdout);
}

static void print_scaling(struct task task, bool by_workers)
{
    double first = 0;
    unsigned most = (unsigned)cpu_available();
    for (unsigned n = 1; n <= most; n = n < most && 2 * n > most ? most : 2 * n) {
        task.threads = n;
        task.workers = by_workers ? n : 1;
        struct process_cost cost = median_cost(render_by_farm, &task);
        if (n == 1)
            first = cost.wall_seconds;
        printf("%4u workers %4u threads  wall %8.1f ms  CPU %8.1f ms  speed-up %5.2f\n", task.workers, n,
               1e3 * cost.wall_seconds, 1e3 * cost.cpu_seconds, first / cost.wall_seconds);
        fflush(stdout);
    }
}

int main(int argc, char **argv)
{
    struct error error;
    int64_t width = 960, height = 540;
    if (argc != 4 && (argc != 5 || options_size("size", argv[4], 1, 16384, &width, &height, &error) != STATUS_OK)) {
        fprintf(stderr, "usage: farm WEFT SCENE SMALL_SCENE [WIDTHxHEIGHT]\n");
        return STATUS_USAGE;
    }
    struct task task = {.weft = argv[1], .scene = argv[2], .width = (uint32_t)width, .height = (uint32_t)height,
                        .threads = 1, .workers = 1};
    snprintf(task.output, sizeof task.output, "/tmp/weft-bench-%d.png", (int)getpid());
    struct task small = task;
    small.scene = argv[3];
    small.width = small.height = 64;
    printf("overhead of the farm, 1 sample a pixel, 1 worker with 1 thread, medians of %d\n", ROUNDS);
    print_overhead(&task);
    print_overhead(&small);
    printf("\nscaling, %s %ux%u, medians of %d\n", task.scene, task.width, task.height, ROUNDS);
    print_scaling(task, false);
    print_scaling(task, true);
    unlink(task.output);
    return 0;
}
