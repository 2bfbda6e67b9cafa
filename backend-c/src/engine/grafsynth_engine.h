/* The table engine of grafsynth: the same text for all charts. A chart is an image, an array of bytes; docs/c.md of grafsynth describes it. */
#ifndef GRAFSYNTH_ENGINE_H
#define GRAFSYNTH_ENGINE_H

#include "grafsynth_image.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The maximum stack depth. */
#define GS_STACK 16U

/* The sizes of an instance. */
typedef struct {
    uint32_t interface; /* identifies inputs and outputs: names, types, order */
    uint16_t inputs;
    uint16_t outputs;
    uint16_t bits;   /* bytes of bits */
    uint16_t values; /* variables and timers */
    uint16_t work;   /* bytes that are used only during a reaction */
} gs_room_t;

/* The memory of an instance, and the data of the current reaction. */
typedef struct {
    GS_ROM uint8_t *image;
    uint8_t *bits;     /* situation, histories, edges */
    int32_t *values;   /* variables, timers */
    const int32_t *in; /* inputs and events */
    int32_t *out;
    uint8_t *work;
    uint16_t chosen; /* transitions that fire */
    int32_t stack[GS_STACK];
    uint16_t cells; /* the place of the rows of cells in the image */
    uint16_t at;
    uint16_t end;
    uint8_t depth;
} gs_run_t;

/* Whether an image can be run: GS_OK, or an error. It is called once; the other functions trust the image. */
uint8_t gs_check(GS_ROM uint8_t *image, uint16_t size, const gs_room_t *room);

/* Resets the chart; returns true if it did not become stable. Each input must be 0, or the value of its range nearest to 0. */
bool gs_init(gs_run_t *run);

/* Runs one reaction, dt ticks after the last; returns true if the chart did not become stable. */
bool gs_step(gs_run_t *run, int32_t dt);

#ifdef __cplusplus
}
#endif

#endif
