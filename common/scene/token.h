/*
 * Words and numbers of a text file, with errors that name the line.
 *
 * The first failure is kept in the reader, and from then on every function here does nothing: read on, then
 * look at the reader's status. What failed leaves the caller's variable as it is.
 */
#ifndef WEFT_SCENE_TOKEN_H
#define WEFT_SCENE_TOKEN_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/error.h"

struct token_reader {
    const char *file; /* what sentences call it */
    const char *at;   /* the next character; a NUL follows the last one */
    const char *end;
    size_t line;         /* of `at`, from 1 */
    bool by_line;        /* ends of lines are tokens and not blanks */
    bool continued;      /* a backslash at the end of a line makes that a blank */
    bool comments;       /* '#' where a token could begin makes the rest of the line a blank */
    struct error *error; /* filled with the first failure */
    enum status status;
};

enum { TOKEN_WORD_BYTES = 1024 };

/* A reader at the beginning of `size` bytes, which a NUL follows; a byte order mark is passed over. By lines,
 * with comments, not continued. */
struct token_reader token_reader_of(const char *file, const void *text, size_t size, struct error *error);

/* "FILE:LINE: …" as the reader's failure. */
void token_refuse(struct token_reader *reader, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* "FILE:LINE: expected …, found …"; what was found is the next token. */
void token_expected(struct token_reader *reader, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* False at the end of the text or after a failure. Goes to the next token first, over ends of lines too. */
bool token_more(struct token_reader *reader);

/* True if the line (or, if not by line, the text) holds no further token. */
bool token_at_end(struct token_reader *reader);

/* True if the next token begins like a number. */
bool token_is_number(struct token_reader *reader);

/* The next token into word[TOKEN_WORD_BYTES]; "" and a failure if there is none or it is longer. `what` is what
 * was expected. */
void token_word(struct token_reader *reader, const char *what, char *word);

/* The rest of the line without blanks around it, likewise. */
void token_rest(struct token_reader *reader, const char *what, char *rest);

/* A number of magnitude at most SCENE_LARGEST. `what` may say more than "a number". */
void token_number(struct token_reader *reader, const char *what, double *number);
void token_numbers(struct token_reader *reader, const char *what, size_t count, double *numbers);

/* A number in min..max. */
void token_number_in(struct token_reader *reader, const char *what, double min, double max, double *number);

/* A whole number in min..max, written without point and exponent. */
void token_whole(struct token_reader *reader, const char *what, int64_t min, int64_t max, int64_t *number);

/* For tokens that the caller has read himself, up to `at`: goes there if a token ends there, else "expected
 * `what`". */
void token_pass(struct token_reader *reader, const char *at, const char *what);

/* Fails unless the line ends here. */
void token_end_line(struct token_reader *reader);

/* Passes over the rest of the line. */
void token_skip_line(struct token_reader *reader);

#endif
