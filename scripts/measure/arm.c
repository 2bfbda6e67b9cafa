/* Counts the instructions of a reaction: a loop of reactions minus the same loop with an empty function. Prints `busy idle` by semihosting: the means for
 * random and for constant inputs; with LARGEST also the largest number for one reaction, with each row of random inputs applied twice. Define REACT(inputs) to
 * measure something other than a plain reaction. */
#include HEADER
#include <string.h>

#ifndef REACT
#define REACT(inputs) TYPE(step)(&self, inputs, &out)
#endif
#define EMPTY(inputs) empty(&self, inputs, &out)

#define ROWS 256
#define SCANS 2560
#define SYST_CSR (*(volatile uint32_t *)0xE000E010U)
#define SYST_RVR (*(volatile uint32_t *)0xE000E014U)
#define SYST_CVR (*(volatile uint32_t *)0xE000E018U)

static TYPE(t) self;
#ifdef LARGEST
static TYPE(t) saved;
#endif
static TYPE(in_t) rows[ROWS];
static TYPE(out_t) out;
#ifdef WITH_RING
static TYPE(ring_t) ring;
#endif
#if defined(LARGEST) && defined(WITH_RING)
static TYPE(ring_t) saved_ring;
#define SAVE_RING (saved_ring = ring)
#define KEEP_RING (ring = saved_ring)
#else
#define SAVE_RING ((void)0)
#define KEEP_RING ((void)0)
#endif

static void call(int operation, const void *argument)
{
    register int r0 __asm__("r0") = operation;
    register const void *r1 __asm__("r1") = argument;
    __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
}

__attribute__((noinline)) static void empty(TYPE(t) *it, const TYPE(in_t) *in, TYPE(out_t) *lamps)
{
    __asm__ volatile("" : : "r"(it), "r"(in), "r"(lamps) : "memory");
}

/* The ticks, of 40 instructions each, that SCANS calls of a function take. */
#define TICKS(function, row) \
    do { \
        SYST_CVR = 0; \
        const uint32_t begin = SYST_CVR; \
        for (uint32_t k = 0; k < SCANS; ++k) { \
            function(&rows[(row) & (ROWS - 1U)]); \
            __asm__ volatile("" : : : "memory"); \
        } \
        ticks = begin - SYST_CVR; \
    } while (0)

/* The ticks of 40 calls with the same instance: the number of instructions of one call. */
#define REPEATED(function, row) \
    do { \
        const uint32_t begin = SYST_CVR; \
        for (uint32_t n = 0; n < 40U; ++n) { \
            self = saved; \
            KEEP_RING; \
            function(&rows[row]); \
            __asm__ volatile("" : : : "memory"); \
        } \
        ticks = (begin - SYST_CVR) & 0xFFFFFFU; \
    } while (0)

static char text[48];

static char *number(char *at, uint32_t tenths)
{
    char digits[12];
    int n = 0;
    const char last = (char)('0' + tenths % 10U);
    tenths /= 10U;
    do {
        digits[n++] = (char)('0' + tenths % 10U);
        tenths /= 10U;
    } while (tenths != 0U);
    while (n > 0) {
        *at++ = digits[--n];
    }
    *at++ = '.';
    *at++ = last;
    return at;
}

void start(void)
{
    uint32_t ticks, none, busy, idle, seed = 12345;
    for (uint32_t k = 0; k < ROWS; ++k) {
        for (uint32_t i = 0; i < sizeof rows[0].bits; ++i) {
            seed = seed * 1664525U + 1013904223U;
            rows[k].bits[i] = (uint8_t)(seed >> 24);
        }
    }
    SYST_RVR = 0xFFFFFFU;
    SYST_CSR = 5U;
    TYPE(init)(&self, &out);
    TICKS(EMPTY, k);
    none = ticks;
    TICKS(REACT, k);
    busy = ticks;
#ifdef LARGEST
    uint32_t largest = 0;
    for (uint32_t k = 0; k < 2U * ROWS; ++k) {
        const uint32_t row = k / 2U;
        saved = self;
        SAVE_RING;
        SYST_CVR = 0;
        REPEATED(EMPTY, row);
        const uint32_t empty_ticks = ticks;
        REPEATED(REACT, row);
        /* Plus 2: the call and the return were subtracted with the empty function. */
        const uint32_t one = ticks - empty_ticks + 2U;
        largest = one > largest ? one : largest;
    }
#endif
    memset(&rows[0], 0, sizeof rows[0]);
    REACT(&rows[0]);
    REACT(&rows[0]);
    TICKS(REACT, 0U);
    idle = ticks;
    /* The call and the return of the empty function belong to a reaction: two instructions. */
    char *at = number(text, (busy - none) * 400U / SCANS + 20U);
    *at++ = ' ';
    at = number(at, (idle - none) * 400U / SCANS + 20U);
#ifdef LARGEST
    *at++ = ' ';
    at = number(at, largest * 10U);
#endif
    *at++ = '\n';
    *at = '\0';
    call(4, text);
    call(0x18, (const void *)0x20026);
    for (;;) {
    }
}

__attribute__((section(".vectors"), used)) static const void *const vectors[2] = {
    (const void *)0x20400000, (const void *)start};
