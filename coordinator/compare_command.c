/* weft compare */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/cpu.h"
#include "base/log.h"
#include "base/memory.h"
#include "base/options.h"
#include "coordinator/commands.h"
#include "coordinator/outputs.h"
#include "image/compare.h"
#include "image/flip.h"
#include "image/image.h"
#include "image/writer.h"

enum { OPTION_MAX_RMSE = 256, OPTION_PPD, OPTION_HELP, OPTION_VERSION };

static const struct option_spec options[] = {
    {OPTION_MAX_RMSE, "max-rmse", "X", "fail, with exit status 1, if the RMSE is above X"},
    {'o', "output", "DIFF.png", "paint the FLIP errors: from black, 0, to yellow, 1"},
    {OPTION_PPD, "ppd", "N", "pixels per degree that FLIP is seen at (default 67)"},
    {OPTION_HELP, "help", NULL, "print this and exit"},
    {OPTION_VERSION, "version", NULL, "print the version and exit"},
    {0},
};

struct arguments {
    const char *paths[2];
    const char *output; /* NULL: none */
    double max_rmse;
    double pixels_per_degree;
};

static void print_help(void)
{
    puts("usage: weft compare [OPTION]... A B\n"
         "Prints how far two images of one size are apart; each is a PNG or a PFM.\n");
    options_help(stdout, options);
    puts("\nRMSE, PSNR and the maximum error compare what a display shows, 0..1: a PNG's\n"
         "values as they are, and a PFM's linear light clamped to 0..1 and sRGB-encoded,\n"
         "unrounded. Transparency is not looked at. FLIP (HPG 2020) is the mean, 0..1, of\n"
         "the error that a person would see who flips between the images: on a display\n"
         "0.7 m wide with 3840 pixels, from 0.7 m, unless --ppd says otherwise.\n"
         "\nExit status: 0 done; 1 the RMSE is above --max-rmse; 2 wrong usage; 3 bad\n"
         "images, or of two sizes; 4 output could not be written; 5 an internal failure.");
}

static enum status take_output(const char *path, struct arguments *a, struct error *error)
{
    size_t length = strlen(path);
    if (length < 4 || strcmp(path + length - 4, ".png") != 0)
        return error_set(error, STATUS_USAGE, "%s: expected an output that ends with .png", path);
    a->output = path;
    return STATUS_OK;
}

static enum status handle_option(void *context, int key, const char *argument, struct error *error)
{
    struct arguments *a = context;
    switch (key) {
    case OPTION_MAX_RMSE:
        return options_number("--max-rmse", argument, 0, 1, &a->max_rmse, error);
    case OPTION_PPD:
        return options_number("--ppd", argument, FLIP_PPD_MIN, FLIP_PPD_MAX, &a->pixels_per_degree, error);
    case 'o':
        return take_output(argument, a, error);
    case OPTION_HELP:
        print_help();
        exit(STATUS_OK);
    default:
        puts("weft " WEFT_VERSION);
        exit(STATUS_OK);
    }
}

/* --- the picture ------------------------------------------------------------------------------------------ */

static enum status write_rows(struct image_writer *writer, const float *errors, uint32_t width, uint32_t height,
                              struct error *error)
{
    uint8_t *row = memory_array(width, 3);
    enum status status = STATUS_OK;
    for (uint32_t y = 0; y < height && status == STATUS_OK; y++) {
        for (uint32_t x = 0; x < width; x++)
            flip_colour(errors[(size_t)y * width + x], row + 3 * (size_t)x);
        status = image_writer_row(writer, row, error);
    }
    free(row);
    return status;
}

static enum status write_picture(const char *path, const float *errors, uint32_t width, uint32_t height,
                                 struct error *error)
{
    const struct image_description description = {
        .width = width,
        .height = height,
        .format = PIXEL_SRGB8,
        .software = "weft " WEFT_VERSION,
        .source = "FLIP errors, in the colours of magma",
    };
    enum status status = STATUS_OK;
    struct image_writer *writer = image_writer_create(path, &description, &status, error);
    if (!writer)
        return status;
    status = write_rows(writer, errors, width, height, error);
    if (status == STATUS_OK)
        return image_writer_complete(&writer, error);
    image_writer_abandon(&writer);
    return status;
}

/* --- the figures ------------------------------------------------------------------------------------------ */

static void print_difference(const struct image *image, const struct image_difference *difference, double flip)
{
    printf("image: %u×%u\nRMSE: %.6g\n", image->width, image->height, difference->rmse);
    if (difference->rmse > 0)
        printf("PSNR: %.2f dB\n", image_psnr(difference->rmse));
    else
        puts("PSNR: infinite");
    printf("maximum error: %.6g\n", difference->maximum);
    printf("off by more than 1/255: %.4g %% of the pixels\n", 100 * difference->share_off);
    printf("FLIP: %.6g\n", flip);
}

/* The picture is written also where the gate is shut: then most of all somebody wants to see it. */
static enum status judge(const struct arguments *a, const struct image_difference *difference, const float *errors,
                         const struct image *image, struct error *error)
{
    enum status status = STATUS_OK;
    if (a->output)
        status = write_picture(a->output, errors, image->width, image->height, error);
    if (status == STATUS_OK && difference->rmse > a->max_rmse)
        status = error_set(error, STATUS_FAILED, "%s and %s: expected an RMSE of at most %g, found %g", a->paths[0],
                           a->paths[1], a->max_rmse, difference->rmse);
    return status;
}

static enum status compare(const struct arguments *a, const struct image images[2], struct error *error)
{
    uint32_t width = images[0].width, height = images[0].height;
    if (width != images[1].width || height != images[1].height)
        return error_set(error, STATUS_INPUT, "expected images of one size, found %s of %u × %u and %s of %u × %u",
                         a->paths[0], width, height, a->paths[1], images[1].width, images[1].height);
    struct image_difference difference = image_compare(&images[0], &images[1], cpu_available());
    float *errors = memory_array((size_t)width * height, sizeof *errors);
    flip_errors(&images[0], &images[1], a->pixels_per_degree, cpu_available(), errors);
    print_difference(&images[0], &difference, flip_mean(errors, width, height));
    enum status status = judge(a, &difference, errors, &images[0], error);
    free(errors);
    return status;
}

static enum status check_output(const struct arguments *a, struct error *error)
{
    const struct output output = {"--output", a->output};
    enum status status = STATUS_OK;
    for (int i = 0; i < 2 && a->output && status == STATUS_OK; i++)
        status = outputs_check_spare(&output, 1, a->paths[i], error);
    return status;
}

static enum status read_and_compare(const struct arguments *a, struct error *error)
{
    struct image images[2] = {0};
    enum status status = check_output(a, error);
    for (int i = 0; i < 2 && status == STATUS_OK; i++)
        status = image_read_file(&images[i], a->paths[i], error);
    if (status == STATUS_OK)
        status = compare(a, images, error);
    image_finish(&images[0]);
    image_finish(&images[1]);
    return status;
}

int command_compare(int argc, char **argv)
{
    struct arguments a = {.max_rmse = 1, .pixels_per_degree = FLIP_PPD_DEFAULT};
    struct error error;
    int first;
    enum status status = options_parse(argc, argv, options, handle_option, &a, &first, &error);
    if (status == STATUS_OK && argc - first != 2)
        status = error_set(&error, STATUS_USAGE, "expected two images; see weft compare --help");
    for (int i = 0; i < 2 && status == STATUS_OK; i++)
        a.paths[i] = argv[first + i];
    if (status == STATUS_OK)
        status = read_and_compare(&a, &error);
    if (status != STATUS_OK)
        log_error("%s", error.text);
    return (int)status;
}
