/* The statechart engine of grafsynth: the same text for all charts. A chart is a table of states and a table of transitions, with an index of the
   transitions by event; docs/c.md of grafsynth describes the tables. */
#ifndef GRAFSYNTH_BTRANS_H
#define GRAFSYNTH_BTRANS_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* The memory of tables. */
#ifndef GB_ROM
#if defined(__AVR__) && defined(__FLASH)
#define GB_ROM const __flash
#elif defined(__SDCC_mcs51)
#define GB_ROM const __code
#else
#define GB_ROM const
#endif
#endif

/* sdcc compiles calls better than inlined code. */
#if defined(__SDCC_mcs51)
#define GB_INLINE static
#else
#define GB_INLINE static inline
#endif

#define GB_NONE 0xFFFFU

/* Status of a state. */
#define GB_ATOMIC 0U
#define GB_HIERARCHICAL 1U /* one of its children is active */
#define GB_CONCURRENT 2U   /* all its children are active */
#define GB_HIST 4U         /* its active descendants are recorded */

typedef struct {
    uint16_t descendant; /* entered by default; GB_NONE: an atomic state */
    uint16_t sibling;    /* the next one, in a ring */
    uint16_t ancestor;   /* GB_NONE: outermost */
    uint16_t last;       /* the last descendant; descendants follow without gaps */
    uint16_t status;
    uint16_t timer; /* its active time; GB_NONE: not used */
    uint16_t entry; /* rules; 0: none */
    uint16_t exit;
} gb_state_t;

/* How a transition moves. */
#define GB_EXTERNAL 0U /* leaves its origin */
#define GB_INTERNAL 1U /* stays in it */
#define GB_STAYS 2U    /* only runs its action */

typedef struct {
    uint16_t from;
    uint16_t to;
    uint16_t kind;
    uint16_t history; /* enters what this history recorded; GB_NONE: default */
    uint16_t guard;   /* rules; 0: none */
    uint16_t action;
} gb_trans_t;

/* The transitions that an event can trigger: `many` rows of the table from `first` on. Row 0 of the index: no event. */
typedef struct {
    uint16_t input;
    uint16_t first;
    uint16_t many;
} gb_event_t;

/* The history of a state. */
typedef struct {
    uint16_t owner;
    uint16_t deep; /* 1: its atomic descendants; 0: its children */
    uint16_t bit;  /* of its first descendant */
    uint16_t to;   /* entered if nothing is recorded */
    uint16_t rule; /* runs then, after the entry of its owner; 0: none */
} gb_history_t;

struct gb_run;

/* The tables of a chart and their lengths. */
typedef struct {
    int32_t (*rule)(struct gb_run *run); /* runs a rule and returns its value; rules from 1 on: the edge operands, then the outputs */
    GB_ROM gb_state_t *bstate;
    GB_ROM gb_trans_t *btrans;
    GB_ROM gb_event_t *index;
    GB_ROM gb_history_t *history;
    GB_ROM int32_t *caps;     /* the maximum of each timer */
    GB_ROM int32_t *values;   /* the variables at reset */
    GB_ROM uint16_t *initial; /* entered at reset */
    uint16_t states;
    uint16_t events;
    uint16_t histories;
    uint16_t timers;
    uint16_t edges;
    uint16_t vars;
    uint16_t initials;
    uint16_t remembered; /* bits of all histories */
    uint16_t limit;      /* of micro-steps */
    uint16_t most;       /* transitions that fire at once */
    bool inner;          /* transitions of inner states come first */
} gb_chart_t;

typedef struct gb_run {
    const gb_chart_t *chart;
    uint8_t *active; /* states, then recorded histories, then edges */
    int32_t *time;
    int32_t *values;
    const int32_t *in;
    uint8_t *marks; /* for each state: exited, entered; each history: default taken; each edge: its operand */
    uint16_t *chosen;
    uint16_t n_chosen;
    uint16_t number; /* of the rule */
    bool fresh;      /* edges are still present */
} gb_run_t;

/* Resets the chart; returns true if it did not become stable. */
bool gb_init(gb_run_t *run);

/* Runs one reaction, dt ticks after the last; returns true if the chart did not become stable. */
bool gb_step(gb_run_t *run, uint32_t dt);

/* The value of an output. */
int32_t gb_output(gb_run_t *run, uint16_t output);

/* A rising or falling edge in this micro-step. */
bool gb_rise(const gb_run_t *run, uint16_t edge);
bool gb_fall(const gb_run_t *run, uint16_t edge);

GB_INLINE bool gb_bit(const uint8_t *bits, uint16_t at)
{
    return (((uint16_t)bits[at >> 3] >> (at & 7U)) & 1U) != 0U;
}

GB_INLINE int32_t gb_truth(bool holds)
{
    int32_t value = 0;
    if (holds) {
        value = 1;
    }
    return value;
}

/* The nearest value between both bounds. */
GB_INLINE int32_t gb_between(int64_t value, int32_t least, int32_t most)
{
    int32_t kept;
    if (value < (int64_t)least) {
        kept = least;
    } else if (value > (int64_t)most) {
        kept = most;
    } else {
        kept = (int32_t)value;
    }
    return kept;
}

#ifdef __cplusplus
}
#endif

#endif
