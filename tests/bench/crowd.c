/*
 * What thousands of workers cost a coordinator: crowd WEFT SCENE WORKERS...
 *
 * `WEFT render` with stand-ins for workers (stand_in.h) over TCP, plain and with keys. First they join and fetch the
 * scene, then all at once they say that they are ready, and bands of one row go to and fro. The last of them, when most
 * workers have nothing to do, count by themselves. A narrow picture, since nobody renders it. All figures are the
 * coordinator's; but stand-ins and coordinator share the machine.
 */
#include <sys/stat.h>

#include "base/options.h"
#include "tests/bench/process.h"
#include "tests/bench/stand_in.h"

/* Knocking: workers that come at once. This machine does their part of the handshakes too, so more than that could meet
 * the limits on how long one may take, try again, and never come to an end. */
enum { WIDTH = 16, ROWS = 65535, MOST_ROWS = ROWS / 10 * 9, WORKERS_MAX = 9000, KNOCKING = 250 };

/* Two descriptors for each stand-in. */
static void raise_descriptor_limit(void)
{
    struct rlimit limit;
    getrlimit(RLIMIT_NOFILE, &limit);
    limit.rlim_cur = limit.rlim_max;
    setrlimit(RLIMIT_NOFILE, &limit);
}

static void work_until(struct crowd *crowd, const size_t *count, size_t until)
{
    while (*count < until)
        crowd_work(crowd);
}

/* What a process took since the lap before. */
struct lap {
    int64_t wall_us;
    double wall_seconds, cpu_seconds, all_cpu_seconds;
};

static void lap(struct lap *lap, const struct process *weft)
{
    int64_t now_us = clock_now_us();
    double cpu = process_cpu_seconds(weft);
    *lap = (struct lap){now_us, 1e-6 * (double)(now_us - lap->wall_us), cpu - lap->all_cpu_seconds, cpu};
}

/* The first is alone at first, so that what the coordinator takes without workers is known. */
static void let_join(struct crowd *crowd, size_t workers, const struct process *weft)
{
    struct lap took = {0};
    crowd_add(crowd);
    work_until(crowd, &crowd->loaded, 1);
    double bytes = process_bytes(weft);
    lap(&took, weft);
    while (crowd->loaded < workers) {
        while (crowd->count < workers && crowd->count < crowd->loaded + KNOCKING)
            crowd_add(crowd);
        crowd_work(crowd);
    }
    lap(&took, weft);
    printf("%7zu  %-5s  %8.2f  %13.1f  %9.1f", workers, crowd->keys ? "CURVE" : "plain", took.wall_seconds,
           1e6 * took.cpu_seconds / (double)workers, 1e-3 * (process_bytes(weft) - bytes) / (double)workers);
    fflush(stdout);
}

static void let_answer(struct crowd *crowd, const struct process *weft)
{
    struct lap took = {0};
    lap(&took, weft);
    crowd_get_ready(crowd);
    work_until(crowd, &crowd->bands, MOST_ROWS);
    lap(&took, weft);
    printf("  %7.0f  %11.1f", MOST_ROWS / took.wall_seconds, 1e6 * took.cpu_seconds / MOST_ROWS);
    fflush(stdout);
    work_until(crowd, &crowd->ended, 1);
    lap(&took, weft);
    printf("  %5.2f  %9.2f", took.wall_seconds, took.cpu_seconds);
    work_until(crowd, &crowd->ended, crowd->count);
}

static void measure(const char *weft, const char *scene, const char *output, size_t workers, const char *keys)
{
    char endpoint[64], size[32];
    struct error error;
    snprintf(endpoint, sizeof endpoint, "tcp://127.0.0.1:%d", process_free_port());
    snprintf(size, sizeof size, "%dx%d", WIDTH, ROWS);
    const char *argv[] = {weft, "render", scene, "--quiet", "--no-resume", "--output", output, "--size", size,
                          "--samples", "4", "--band", "1", "--workers", "0", "--listen", endpoint,
                          keys ? "--keys" : NULL, keys, NULL};
    struct process process = process_start(argv);
    crowd_check(wire_start(&error), &error);
    struct crowd crowd = crowd_of(workers, endpoint, keys);
    let_join(&crowd, workers, &process);
    let_answer(&crowd, &process);
    printf("  %7.1f  %11" PRIu64 "\n", 1e-6 * process_wait(&process, weft).peak_bytes, crowd.reconnections);
    fflush(stdout);
    crowd_finish(&crowd);
    wire_stop();
    unlink(output);
}

static void remove_keys(const char *folder)
{
    static const char *const names[] = {"coordinator.key", "coordinator.pub", "worker.key", "worker.pub", "watcher.key",
                                        "watcher.pub", "workers", "watchers", ""};
    char path[192];
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        snprintf(path, sizeof path, "%s/keys/%s", folder, names[i]);
        remove(path);
    }
}

int main(int argc, char **argv)
{
    char folder[] = "/tmp/weft-crowd-XXXXXX", keys[64], output[64];
    struct error error;
    if (argc < 4) {
        fprintf(stderr, "usage: crowd WEFT SCENE WORKERS...\n");
        return STATUS_USAGE;
    }
    raise_descriptor_limit();
    if (!mkdtemp(folder))
        process_fail(folder, "cannot be made");
    snprintf(keys, sizeof keys, "%s/keys", folder);
    snprintf(output, sizeof output, "%s/crowd.png", folder);
    crowd_check(keys_make(keys, &error), &error);
    printf("%dx%d, bands of one row\nworkers  link   joined s  CPU us/worker  kB/worker  bands/s  CPU us/band  end s  "
           "end CPU s  peak MB  reconnected\n", WIDTH, ROWS);
    for (int i = 3; i < argc; i++) {
        int64_t workers;
        crowd_check(options_integer("WORKERS", argv[i], 2, WORKERS_MAX, &workers, &error), &error);
        measure(argv[1], argv[2], output, (size_t)workers, NULL);
        measure(argv[1], argv[2], output, (size_t)workers, keys);
    }
    remove_keys(folder);
    rmdir(folder);
    return 0;
}
