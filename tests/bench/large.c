/*
 * A picture that is larger than what a coordinator should hold: large WEFT WORKER SCENE SIDE.
 *
 * `WEFT render` of SIDE×SIDE pixels, one sample each, with one WORKER of all cores: once alone, and once beside a
 * stand-in (stand_in.h) that gets the first rows and never answers, so that all others wait below them until the end.
 * Rows wait in the journal; memory is to be far less than the picture.
 */
#include <sys/stat.h>

#include "base/options.h"
#include "tests/bench/process.h"
#include "tests/bench/stand_in.h"

static struct process start_weft(const char *weft, const char *scene, const char *output, int64_t side,
                                 const char *endpoint)
{
    char size[32];
    snprintf(size, sizeof size, "%" PRId64 "x%" PRId64, side, side);
    const char *argv[] = {weft, "render", scene, "--quiet", "--output", output, "--size", size, "--samples", "1",
                          "--workers", "0", "--listen", endpoint, NULL};
    return process_start(argv);
}

static struct process start_worker(const char *program, const char *endpoint)
{
    const char *argv[] = {program, "--once", "--quiet", endpoint, NULL};
    return process_start(argv);
}

static void render_alone(const char *endpoint, const char *worker_program)
{
    struct process worker = start_worker(worker_program, endpoint);
    process_wait(&worker, worker_program);
}

/* First come, the stand-in gets the first rows of either pass. */
static void render_held_up(const char *endpoint, const char *worker_program)
{
    struct error error;
    crowd_check(wire_start(&error), &error);
    struct crowd crowd = crowd_of(1, endpoint, NULL);
    crowd.ready = crowd.mute = true;
    crowd_add(&crowd);
    while (crowd.bands == 0)
        crowd_work(&crowd);
    struct process worker = start_worker(worker_program, endpoint);
    while (crowd.ended == 0)
        crowd_work(&crowd);
    crowd_finish(&crowd);
    wire_stop();
    process_wait(&worker, worker_program);
}

static void measure(char **argv, int64_t side, bool held_up)
{
    char output[64], endpoint[64];
    struct stat file;
    snprintf(output, sizeof output, "/tmp/weft-large-%d.png", (int)getpid());
    snprintf(endpoint, sizeof endpoint, "tcp://127.0.0.1:%d", process_free_port());
    struct process weft = start_weft(argv[1], argv[3], output, side, endpoint);
    (held_up ? render_held_up : render_alone)(endpoint, argv[2]);
    struct process_cost cost = process_wait(&weft, argv[1]);
    if (stat(output, &file) != 0)
        process_fail(output, "is not there");
    printf("%-15s  %6.1f  %10.1f  %12.1f  %6.1f\n", held_up ? "first rows last" : "undisturbed", cost.wall_seconds,
           cost.cpu_seconds, 1e-6 * cost.peak_bytes, 1e-6 * (double)file.st_size);
    fflush(stdout);
    unlink(output);
}

int main(int argc, char **argv)
{
    int64_t side = 0;
    struct error error;
    if (argc != 5 || options_integer("SIDE", argv[4], 1, 65535, &side, &error) != STATUS_OK) {
        fprintf(stderr, "usage: large WEFT WORKER SCENE SIDE\n");
        return STATUS_USAGE;
    }
    printf("%" PRId64 "x%" PRId64 ": %.0f MB of pixels\n                 wall s  weft CPU s  weft peak MB  PNG MB\n",
           side, side, 3e-6 * (double)side * (double)side);
    measure(argv, side, false);
    measure(argv, side, true);
    return 0;
}
