/*
 * What surveys of untruthful workers make of a render: the sampling that is chosen must be one that workers take, and
 * no error may be told that is below 0. An input is the error to be met, the most samples, the render's own estimates,
 * and parts of the survey, whose steps are given by policy, threshold, which number, and the number.
 */
#include "base/bytes.h"
#include "tests/fuzz/fuzz.h"
#include "trace/survey.h"
#include "worker/order.h"

enum { WIDTH = 40, HEIGHT = 30 };

/* Surveys travel as bytes, so that is how they are made. */
static void add_part(struct survey *survey, struct byte_reader *input)
{
    static uint8_t bytes[SURVEY_BYTES];
    struct survey part = {.pixels = byte_reader_u64(input), .rays = byte_reader_u64(input)};
    for (unsigned steps = byte_reader_u8(input); steps > 0 && !input->failed; steps--) {
        unsigned policy = byte_reader_u8(input) % SURVEY_POLICIES, threshold = byte_reader_u8(input);
        unsigned which = byte_reader_u8(input) % 5;
        struct survey_outcome *step = &part.steps[policy][threshold];
        int64_t *numbers[] = {&step->samples, &step->error[0], &step->error[1], &step->estimated[0],
                              &step->estimated[1]};
        *numbers[which] = (int64_t)byte_reader_u64(input);
    }
    survey_write(&part, bytes);
    survey_read(&part, bytes);
    survey_add(survey, &part);
}

static void require_taken(enum render_pass pass, const struct sampling *sampling)
{
    struct order order = {.pass = pass, .rows = 1, .sampling = *sampling};
    require(order_fits(&order, &(struct job_settings){.width = WIDTH, .height = HEIGHT}));
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct byte_reader input = byte_reader_of(data, size);
    double error = (1 + byte_reader_u8(&input)) / 512.0;
    uint32_t most = sampling_stage(1 + byte_reader_u8(&input) % (SAMPLING_STAGES - 1));
    uint64_t estimated[2] = {byte_reader_u64(&input), byte_reader_u64(&input)};
    struct sampling surveying = survey_sampling(most, error);
    static struct survey survey;
    survey = (struct survey){0};
    do
        add_part(&survey, &input);
    while (!input.failed && input.at < input.size);
    struct sampling chosen = survey_choose(&survey, &surveying, error);
    require_taken(PASS_SURVEY, &surveying);
    require_taken(PASS_RENDER, &chosen);
    require(survey_error(&survey, &chosen, WIDTH * HEIGHT, estimated) >= 0);
    require(survey_error_of_one(&survey) >= 0);
    return 0;
}
