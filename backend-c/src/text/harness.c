#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Reads the next number of the line; false at its end. */
static bool bench_number(int64_t *value)
{
    int c = getchar();
    while (c == ' ' || c == '\t' || c == '\r') {
        c = getchar();
    }
    if (c == EOF || c == '\n') {
        return false;
    }
    const bool negative = c == '-';
    uint64_t digits = 0;
    if (negative) {
        c = getchar();
    }
    while (c >= '0' && c <= '9') {
        digits = digits * 10U + (uint64_t)(c - '0');
        c = getchar();
    }
    if (c != EOF) {
        ungetc(c, stdin);
    }
    *value = negative ? -(int64_t)digits : (int64_t)digits;
    return true;
}

static void bench_end_of_line(void)
{
    int c = getchar();
    while (c != '\n' && c != EOF) {
        c = getchar();
    }
}

static void bench_wrong(const char *what)
{
    fputs(what, stderr);
    fputc('\n', stderr);
    exit(4);
}

static void bench_print(int64_t value)
{
    char digits[24];
    int at = 24;
    uint64_t rest = value < 0 ? 0U - (uint64_t)value : (uint64_t)value;
    do {
        digits[--at] = (char)('0' + (int)(rest % 10U));
        rest /= 10U;
    } while (rest != 0U);
    if (value < 0) {
        digits[--at] = '-';
    }
    fwrite(&digits[at], 1, (size_t)(24 - at), stdout);
}

/* Prints a name if it is wanted, after a blank unless it is the first. */
static void bench_name(bool is_wanted, const char *name, const char **blank)
{
    if (is_wanted) {
        fputs(*blank, stdout);
        fputs(name, stdout);
        *blank = " ";
    }
}

/* The calls of one function in one reaction. */
typedef struct {
    int64_t count;
    char *text;
    size_t length;
    size_t room;
} bench_calls_t;

static void bench_add(bench_calls_t *calls, int64_t value, char joint)
{
    if (calls->length + 32U > calls->room) {
        calls->room = calls->room * 2U + 64U;
        calls->text = (char *)realloc(calls->text, calls->room);
        if (calls->text == NULL) {
            exit(1);
        }
    }
    if (joint != '\0') {
        calls->text[calls->length++] = joint;
    }
    calls->length += (size_t)snprintf(&calls->text[calls->length], 24, "%lld", (long long)value);
}
static void bench_unused(void)
{
    (void)bench_number;
    (void)bench_end_of_line;
    (void)bench_print;
    (void)bench_name;
    (void)bench_add;
    (void)bench_wrong;
}
