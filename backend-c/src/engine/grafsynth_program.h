/* The program engine of grafsynth: the same text for all charts. A chart is an image, an array of bytes; docs/c.md of grafsynth describes it. */
#ifndef GRAFSYNTH_PROGRAM_H
#define GRAFSYNTH_PROGRAM_H

#include "grafsynth_image.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The maximum stack depth and loop nesting. */
#define GP_STACK 16U
#define GP_LOOPS 3U

/* Requests of gp_go to the caller. */
#define GP_DONE 0U
#define GP_ASK 1U   /* the caller must put the answer of an extern condition into in[number] */
#define GP_CALL 2U  /* extern action number, its arguments in stack[0], stack[1] and so on */
#define GP_TEXT 3U  /* user text with this number */
#define GP_FIRED 4U /* transition number fires */
#define GP_MICRO 5U /* a micro-step begins */

/* The sizes of an instance, and its parameters. */
typedef struct {
    uint32_t interface; /* identifies inputs, outputs and functions: names, types, order */
    uint32_t rounds;    /* the maximum for a loop, multiplied by the rounds of the loops around it */
    uint16_t inputs;    /* and answers of extern conditions */
    uint16_t outputs;
    uint16_t calls;
    uint16_t texts;
    uint16_t fired;
    uint16_t bits;    /* bytes of bits */
    uint16_t values;  /* numbers */
    uint16_t flags;   /* bytes of bits within a reaction */
    uint16_t numbers; /* numbers within a reaction */
} gp_room_t;

/* The memory of an instance, and the data of the current reaction. */
typedef struct {
    GS_ROM uint8_t *image;
    uint8_t *bits;       /* the state: truth values */
    int32_t *values;     /* the state: numbers */
    const int32_t *in;   /* inputs, events, answers of conditions */
    int32_t *out;
    uint8_t *flags;
    int64_t *numbers;
    uint32_t dt;
    int64_t stack[GP_STACK];
    uint32_t rounds[GP_LOOPS]; /* left for each loop */
    uint16_t begins[GP_LOOPS];
    uint16_t cells; /* the place of the rows of cells in the image */
    uint16_t at;
    uint16_t end;
    uint16_t number; /* of the request that gp_go returned */
    uint8_t depth;
    uint8_t loops;
    bool fault; /* the chart did not become stable, or a queue was full */
} gp_run_t;

/* Whether an image can be run: GS_OK, or an error. It is called once; the other functions trust the image. */
uint8_t gp_check(GS_ROM uint8_t *image, uint16_t size, const gp_room_t *room);

/* Begins a reset or a reaction; image, bits, values, in, out, flags, numbers and dt must be set. */
void gp_begin(gp_run_t *run, bool reset);

/* Continues until the reset or reaction is done or has a request; returns GP_DONE or the request. */
uint8_t gp_go(gp_run_t *run);

#ifdef __cplusplus
}
#endif

#endif
