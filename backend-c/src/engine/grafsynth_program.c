/* The program engine of grafsynth: the same text for all charts. Do not edit. */
#include "grafsynth_program.h"

#define GP_VERSION 1U
#define GP_KIND 4U

/* The header of an image. */
#define GP_AT_BITS 16U
#define GP_AT_VALUES 18U
#define GP_AT_FLAGS 20U
#define GP_AT_NUMBERS 22U
#define GP_AT_CELLS 24U
#define GP_AT_RESET 26U
#define GP_AT_REACTION 28U
#define GP_BODY 32U
#define GP_CELL_ROW 12U

/* Instructions. Those below GP_OP_NOT push a value; the operand follows the instruction. */
#define GP_OP_BYTE 0U
#define GP_OP_LONG 1U
#define GP_OP_WIDE 2U
#define GP_OP_DT 3U
#define GP_OP_INPUT 4U
#define GP_OP_BIT 5U
#define GP_OP_VALUE 6U
#define GP_OP_FLAG 7U
#define GP_OP_NUMBER 8U
#define GP_OP_ELEMENT 9U
#define GP_OP_NOT 10U
#define GP_OP_NEG 11U
#define GP_OP_AND 12U
#define GP_OP_OR 13U
#define GP_OP_EQ 14U
#define GP_OP_NE 15U
#define GP_OP_LT 16U
#define GP_OP_LE 17U
#define GP_OP_GT 18U
#define GP_OP_GE 19U
#define GP_OP_ADD 20U
#define GP_OP_SUB 21U
#define GP_OP_MUL 22U
#define GP_OP_DIV 23U
#define GP_OP_MOD 24U
#define GP_OP_SET_BIT 25U
#define GP_OP_SET_VALUE 26U
#define GP_OP_SET_FLAG 27U
#define GP_OP_SET_NUMBER 28U
#define GP_OP_SET_ELEMENT 29U
#define GP_OP_OUTPUT 30U
#define GP_OP_FAULT 31U
#define GP_OP_ASK 32U
#define GP_OP_CALL 33U
#define GP_OP_TEXT 34U
#define GP_OP_FIRED 35U
#define GP_OP_MICRO 36U
/* Control. All but WHILE and AGAIN have a length: they contain that many of the following bytes. */
#define GP_OP_UNLESS 37U /* skips them if false */
#define GP_OP_ELSE 38U   /* the end of UNLESS: skips what follows */
#define GP_OP_ANDTHEN 39U
#define GP_OP_ORELSE 40U
#define GP_OP_LOOP 41U
#define GP_OP_WHILE 42U /* leaves the loop if false */
#define GP_OP_AGAIN 43U /* the end of LOOP */
/* Bit operators: two's complement of 64 bits; amounts are 0 to 63. */
#define GP_OP_BIT_AND 44U
#define GP_OP_BIT_OR 45U
#define GP_OP_BIT_XOR 46U
#define GP_OP_SHL 47U
#define GP_OP_SHR 48U
#define GP_N_OPS 49U

/* The number of values that an instruction pops and pushes (a nibble each), and the bytes of its operand. */
static GS_ROM uint8_t gp_stack_use[GP_N_OPS] = {
    0x01U, 0x01U, 0x01U, 0x01U, 0x01U, 0x01U, 0x01U, 0x01U, 0x01U, 0x11U, 0x11U, 0x11U, 0x21U, 0x21U, 0x21U,
    0x21U, 0x21U, 0x21U, 0x21U, 0x21U, 0x21U, 0x21U, 0x21U, 0x21U, 0x21U, 0x10U, 0x10U, 0x10U, 0x10U, 0x20U,
    0x10U, 0x10U, 0x00U, 0x00U, 0x00U, 0x00U, 0x00U, 0x10U, 0x00U, 0x10U, 0x10U, 0x00U, 0x10U, 0x00U, 0x21U,
    0x21U, 0x21U, 0x21U, 0x21U
};
static GS_ROM uint8_t gp_operand[GP_N_OPS] = {
    1U, 4U, 8U, 0U, 2U, 2U, 2U, 2U, 2U, 2U, 0U, 0U, 0U, 0U, 0U, 0U, 0U, 0U, 0U, 0U, 0U, 0U,
    0U, 0U, 0U, 2U, 2U, 2U, 2U, 2U, 2U, 0U, 2U, 3U, 2U, 2U, 0U, 2U, 2U, 2U, 2U, 6U, 0U, 0U,
    0U, 0U, 0U, 0U, 0U
};

/* --- checking ----------------------------------------------------------------------------------------------------------------------------- */

/* The maximum nesting depth. */
#define GP_NEST 32U

typedef struct {
    uint32_t rounds; /* maximum, multiplied with those of all enclosing loops */
    uint16_t end;
    uint8_t kind;  /* the instruction that opened it */
    uint8_t depth; /* stack depth at its end; for UNLESS at its start */
} gp_region_t;

static uint32_t gp_bytes(uint32_t bits)
{
    return (bits + 7U) >> 3;
}

static bool gp_cells_are_good(GS_ROM uint8_t *image)
{
    const uint32_t values = gs_u16(image, GP_AT_VALUES);
    bool good = true;
    for (uint16_t cell = 0U; good && (cell < gs_u16(image, GP_AT_CELLS)); ++cell) {
        const uint16_t row = (uint16_t)(GP_BODY + (GP_CELL_ROW * cell));
        const uint32_t last = (uint32_t)gs_u16(image, row) + gs_u16(image, (uint16_t)(row + 2U));
        good = (gs_u16(image, (uint16_t)(row + 2U)) > 0U) && (last <= values);
    }
    return good;
}

/* The number of objects that an instruction can refer to; 65535 if it refers to none. */
static uint16_t gp_many(GS_ROM uint8_t *image, const gp_room_t *room, uint8_t op)
{
    uint16_t many = 0xFFFFU;
    switch (op) {
    case GP_OP_INPUT:
    case GP_OP_ASK:
        many = room->inputs;
        break;
    case GP_OP_BIT:
    case GP_OP_SET_BIT:
        many = gs_u16(image, GP_AT_BITS);
        break;
    case GP_OP_VALUE:
    case GP_OP_SET_VALUE:
    case GP_OP_ELEMENT:
    case GP_OP_SET_ELEMENT:
        many = gs_u16(image, GP_AT_CELLS);
        break;
    case GP_OP_FLAG:
    case GP_OP_SET_FLAG:
        many = gs_u16(image, GP_AT_FLAGS);
        break;
    case GP_OP_NUMBER:
    case GP_OP_SET_NUMBER:
        many = gs_u16(image, GP_AT_NUMBERS);
        break;
    case GP_OP_OUTPUT:
        many = room->outputs;
        break;
    case GP_OP_CALL:
        many = room->calls;
        break;
    case GP_OP_TEXT:
        many = room->texts;
        break;
    case GP_OP_FIRED:
        many = room->fired;
        break;
    default:
        break;
    }
    return many;
}

/* Whether a part of the code stays within its bytes, its stack and its rounds. Every part that is skipped or repeated is contained in an instruction, is
   closed within the one around it, and leaves the stack as deep as skipping it does; so one pass from first to last checks everything. */
static uint8_t gp_check_code(GS_ROM uint8_t *image, const gp_room_t *room, uint16_t first, uint16_t end)
{
    gp_region_t open[GP_NEST];
    uint8_t found = GS_OK;
    uint16_t at = first;
    uint8_t n = 1U;
    uint8_t depth = 0U;
    uint8_t loops = 0U;
    open[0].rounds = 1U;
    open[0].end = end;
    open[0].kind = GP_N_OPS;
    open[0].depth = 0U;
    while ((found == GS_OK) && (at < end)) {
        const uint8_t op = image[at];
        const uint16_t operand = (uint16_t)(at + 1U);
        bool good = op < GP_N_OPS;
        bool again = op == GP_OP_AGAIN;
        gp_region_t inner;
        inner = open[n - 1U];
        if (good) {
            const uint8_t size = gp_operand[op];
            const uint8_t takes = gp_stack_use[op] >> 4;
            good = (size < (uint16_t)(inner.end - at)) && (takes <= depth);
            at = (uint16_t)(operand + size);
            depth = (uint8_t)((uint8_t)(depth - takes) + (uint8_t)(gp_stack_use[op] & 15U));
        }
        good = good && (depth <= GP_STACK);
        if (good && (gp_operand[op] >= 2U) && (op > GP_OP_WIDE) && (op < GP_OP_UNLESS)) {
            good = gs_u16(image, operand) < gp_many(image, room, op);
        }
        if (good && ((op == GP_OP_ASK) || (op == GP_OP_TEXT) || (op == GP_OP_FIRED) || (op == GP_OP_MICRO))) {
            good = depth == 0U;
        }
        if (good && (op == GP_OP_CALL)) {
            /* A call pops all values. */
            good = image[(uint16_t)(operand + 2U)] == depth;
            depth = 0U;
        }
        if (good && (op >= GP_OP_UNLESS)) {
            if (op == GP_OP_AGAIN) {
                good = (inner.kind == GP_OP_LOOP) && (at == inner.end);
            } else if (op == GP_OP_WHILE) {
                good = (inner.kind == GP_OP_LOOP) && (depth == 0U);
            } else {
                gp_region_t next;
                const uint16_t length_at = (op == GP_OP_LOOP) ? (uint16_t)(operand + 4U) : operand;
                const uint16_t far = gs_u16(image, length_at);
                next.rounds = inner.rounds;
                next.kind = op;
                next.depth = depth;
                if (op == GP_OP_ELSE) {
                    good = (inner.kind == GP_OP_UNLESS) && (at == inner.end);
                    depth = inner.depth;
                    if (good) {
                        --n;
                    }
                } else if (op == GP_OP_LOOP) {
                    const uint32_t limit = gs_u32(image, operand);
                    good = (depth == 0U) && (loops < GP_LOOPS) && (far > 0U);
                    next.depth = 0U;
                    if (good && (limit > (room->rounds / inner.rounds))) {
                        found = GS_ROOM;
                    }
                    next.rounds = (limit > 0U) ? (inner.rounds * limit) : inner.rounds;
                    ++loops;
                } else if (op != GP_OP_UNLESS) {
                    /* The deciding value stays on the stack if the rest is skipped. */
                    ++next.depth;
                } else {
                    /* UNLESS */
                }
                good = good && (n < GP_NEST) && (far <= (uint16_t)(open[n - 1U].end - at));
                if (good) {
                    next.end = (uint16_t)(at + far);
                    open[n] = next;
                    ++n;
                }
            }
        }
        /* Parts that end here; the outermost ends with the code. */
        while (good && (n > 1U) && (open[n - 1U].end == at)) {
            if (open[n - 1U].kind == GP_OP_LOOP) {
                /* A loop must end with AGAIN. */
                good = again && (depth == 0U);
                again = false;
                --loops;
            } else {
                good = open[n - 1U].depth == depth;
            }
            --n;
        }
        if (!good) {
            found = GS_RANGE;
        }
    }
    if ((found == GS_OK) && ((n != 1U) || (depth != 0U))) {
        found = GS_RANGE;
    }
    return found;
}

uint8_t gp_check(GS_ROM uint8_t *image, uint16_t size, const gp_room_t *room)
{
    uint8_t found = GS_OK;
    if (size < GP_BODY) {
        found = GS_SHORT;
    } else if ((image[0] != 0x47U) || (image[1] != 0x53U) || (image[2] != 0x54U) || (image[3] != 0x42U)) {
        found = GS_MAGIC;
    } else if ((image[4] != GP_VERSION) || (image[GS_AT_KIND] != GP_KIND)) {
        found = GS_VERSION;
    } else if ((gs_u16(image, GS_AT_LENGTH) > size) || (gs_u16(image, GS_AT_LENGTH) < GP_BODY)) {
        found = GS_SHORT;
    } else if (gs_crc(image, gs_u16(image, GS_AT_LENGTH)) != gs_u32(image, GS_AT_CRC)) {
        found = GS_CRC;
    } else if (gs_u32(image, GS_AT_INTERFACE) != room->interface) {
        found = GS_INTERFACE;
    } else {
        const uint32_t cells = GP_CELL_ROW * (uint32_t)gs_u16(image, GP_AT_CELLS);
        const uint32_t reset = gs_u16(image, GP_AT_RESET);
        const uint32_t length = GP_BODY + cells + reset + gs_u16(image, GP_AT_REACTION);
        if ((length != gs_u16(image, GS_AT_LENGTH)) || !gp_cells_are_good(image)) {
            found = GS_RANGE;
        } else if ((gp_bytes(gs_u16(image, GP_AT_BITS)) > room->bits) || (gs_u16(image, GP_AT_VALUES) > room->values)
                   || (gp_bytes(gs_u16(image, GP_AT_FLAGS)) > room->flags) || (gs_u16(image, GP_AT_NUMBERS) > room->numbers)) {
            found = GS_ROOM;
        } else {
            const uint16_t first = (uint16_t)(GP_BODY + cells);
            found = gp_check_code(image, room, first, (uint16_t)(first + reset));
            if (found == GS_OK) {
                found = gp_check_code(image, room, (uint16_t)(first + reset), (uint16_t)length);
            }
        }
    }
    return found;
}

/* --- arithmetic --------------------------------------------------------------------------------------------------------------------------- */

/* Interprets a number as two's complement, on every machine. */
static int64_t gp_signed(uint64_t value) GS_ON_STACK
{
    int64_t result;
    if ((value >> 63) == 0U) {
        result = (int64_t)value;
    } else {
        const uint64_t below = ~value;
        result = -(int64_t)below - 1;
    }
    return result;
}

static uint64_t gp_magnitude(int64_t value) GS_ON_STACK
{
    return (value < 0) ? ((uint64_t)0U - (uint64_t)value) : (uint64_t)value;
}

/* sdcc for the 8051 adds, shifts and compares 64-bit numbers, but its library lacks other operations. */
#if defined(__SDCC_mcs51)
static uint64_t gp_mul(uint64_t a, uint64_t b) GS_ON_STACK
{
    uint64_t x = a;
    uint64_t y = b;
    uint64_t sum = 0U;
    while (y != 0U) {
        if ((y & 1U) != 0U) {
            sum += x;
        }
        x += x;
        y >>= 1;
    }
    return sum;
}

static uint64_t gp_div(uint64_t a, uint64_t b, bool wants_rest) GS_ON_STACK
{
    uint64_t quotient = a;
    uint64_t rest = 0U;
    for (uint8_t i = 0U; i < 64U; ++i) {
        const uint8_t top = (uint8_t)(quotient >> 63);
        quotient += quotient;
        rest += rest;
        rest |= top;
        if (rest >= b) {
            rest -= b;
            quotient |= 1U;
        }
    }
    return wants_rest ? rest : quotient;
}
#else
static uint64_t gp_mul(uint64_t a, uint64_t b) GS_ON_STACK
{
    return a * b;
}

static uint64_t gp_div(uint64_t a, uint64_t b, bool wants_rest) GS_ON_STACK
{
    uint64_t value;
    if (wants_rest) {
        value = a % b;
    } else {
        value = a / b;
    }
    return value;
}
#endif

/* Rounds toward zero; the remainder has the sign of the dividend. A division by 0 gives 0. */
static int64_t gp_divide(int64_t a, int64_t b, bool wants_rest) GS_ON_STACK
{
    int64_t value = 0;
    if (b != 0) {
        const uint64_t size = gp_div(gp_magnitude(a), gp_magnitude(b), wants_rest);
        const bool differs = (a < 0) ? (b > 0) : (b < 0);
        const bool is_negative = wants_rest ? (a < 0) : differs;
        value = gp_signed(is_negative ? ((uint64_t)0U - size) : size);
    }
    return value;
}

/* The amount of a shift; a damaged image may contain any. */
static uint8_t gp_amount(int64_t by) GS_ON_STACK
{
    return (uint8_t)((uint64_t)by & 63U);
}

/* Rounds down: the complement of a negative number is shifted. */
static int64_t gp_shift_right(int64_t a, uint8_t by) GS_ON_STACK
{
    const uint64_t flip = (a < 0) ? UINT64_MAX : (uint64_t)0U;
    return gp_signed((((uint64_t)a ^ flip) >> by) ^ flip);
}

static int64_t gp_truth(bool value) GS_ON_STACK
{
    return value ? 1 : 0;
}

static int64_t gp_two(uint8_t op, int64_t a, int64_t b)
{
    int64_t value = 0;
    switch (op) {
    case GP_OP_AND:
        value = gp_truth((a != 0) && (b != 0));
        break;
    case GP_OP_OR:
        value = gp_truth((a != 0) || (b != 0));
        break;
    case GP_OP_EQ:
        value = gp_truth(a == b);
        break;
    case GP_OP_NE:
        value = gp_truth(a != b);
        break;
    case GP_OP_LT:
        value = gp_truth(a < b);
        break;
    case GP_OP_LE:
        value = gp_truth(a <= b);
        break;
    case GP_OP_GT:
        value = gp_truth(a > b);
        break;
    case GP_OP_GE:
        value = gp_truth(a >= b);
        break;
    case GP_OP_ADD:
        value = gp_signed((uint64_t)a + (uint64_t)b);
        break;
    case GP_OP_SUB:
        value = gp_signed((uint64_t)a - (uint64_t)b);
        break;
    case GP_OP_MUL:
        value = gp_signed(gp_mul((uint64_t)a, (uint64_t)b));
        break;
    case GP_OP_DIV:
        value = gp_divide(a, b, false);
        break;
    case GP_OP_MOD:
        value = gp_divide(a, b, true);
        break;
    case GP_OP_BIT_AND:
        value = gp_signed((uint64_t)a & (uint64_t)b);
        break;
    case GP_OP_BIT_OR:
        value = gp_signed((uint64_t)a | (uint64_t)b);
        break;
    case GP_OP_BIT_XOR:
        value = gp_signed((uint64_t)a ^ (uint64_t)b);
        break;
    case GP_OP_SHL:
        value = gp_signed((uint64_t)a << gp_amount(b));
        break;
    case GP_OP_SHR:
        value = gp_shift_right(a, gp_amount(b));
        break;
    default:
        break;
    }
    return value;
}

/* --- cells -------------------------------------------------------------------------------------------------------------------------------- */

static uint16_t gp_row(uint16_t cell)
{
    return (uint16_t)(GP_BODY + (GP_CELL_ROW * cell));
}

/* An element of a cell; 0 if it does not exist. */
static int64_t gp_get(const gp_run_t *run, uint16_t cell, int64_t index) GS_ON_STACK
{
    const uint16_t row = gp_row(cell);
    const uint16_t first = gs_u16(run->image, row);
    int64_t value = 0;
    if ((index >= 0) && (index < (int64_t)gs_u16(run->image, (uint16_t)(row + 2U)))) {
        value = run->values[first + (uint16_t)index];
    }
    return value;
}

/* Stores the nearest value in the range of the cell; does nothing if the element does not exist. */
static void gp_set(const gp_run_t *run, uint16_t cell, int64_t index, int64_t value) GS_ON_STACK
{
    const uint16_t row = gp_row(cell);
    const uint16_t first = gs_u16(run->image, row);
    const int32_t least = gs_i32(run->image, (uint16_t)(row + 4U));
    const int32_t most = gs_i32(run->image, (uint16_t)(row + 8U));
    if ((index >= 0) && (index < (int64_t)gs_u16(run->image, (uint16_t)(row + 2U)))) {
        int32_t kept;
        if (value < (int64_t)least) {
            kept = least;
        } else if (value > (int64_t)most) {
            kept = most;
        } else {
            kept = (int32_t)value;
        }
        run->values[first + (uint16_t)index] = kept;
    }
}

static int32_t gp_narrow(int64_t value) GS_ON_STACK
{
    int32_t kept;
    if (value < (int64_t)INT32_MIN) {
        kept = (int32_t)INT32_MIN;
    } else if (value > (int64_t)INT32_MAX) {
        kept = (int32_t)INT32_MAX;
    } else {
        kept = (int32_t)value;
    }
    return kept;
}

/* --- running ------------------------------------------------------------------------------------------------------------------------------ */

static int64_t gp_leaf(const gp_run_t *run, uint8_t op, uint16_t at) GS_ON_STACK
{
    GS_ROM uint8_t *image = run->image;
    int64_t value = 0;
    switch (op) {
    case GP_OP_BYTE:
        value = (image[at] < 128U) ? (int64_t)image[at] : ((int64_t)image[at] - 256);
        break;
    case GP_OP_LONG:
        value = gs_i32(image, at);
        break;
    case GP_OP_WIDE:
        value = gp_signed(((uint64_t)gs_u32(image, (uint16_t)(at + 4U)) << 32) | gs_u32(image, at));
        break;
    case GP_OP_DT:
        value = (int64_t)run->dt;
        break;
    case GP_OP_INPUT:
        value = run->in[gs_u16(image, at)];
        break;
    case GP_OP_BIT:
        value = gp_truth(gs_bit(run->bits, gs_u16(image, at)));
        break;
    case GP_OP_VALUE:
        value = gp_get(run, gs_u16(image, at), 0);
        break;
    case GP_OP_FLAG:
        value = gp_truth(gs_bit(run->flags, gs_u16(image, at)));
        break;
    case GP_OP_NUMBER:
        value = run->numbers[gs_u16(image, at)];
        break;
    default:
        break;
    }
    return value;
}

/* Stores a value. Only SET_ELEMENT uses the index. */
static void gp_put_away(gp_run_t *run, uint8_t op, uint16_t number, int64_t value, int64_t index)
{
    switch (op) {
    case GP_OP_SET_BIT:
        gs_put(run->bits, number, value != 0);
        break;
    case GP_OP_SET_VALUE:
        gp_set(run, number, 0, value);
        break;
    case GP_OP_SET_FLAG:
        gs_put(run->flags, number, value != 0);
        break;
    case GP_OP_SET_NUMBER:
        run->numbers[number] = value;
        break;
    case GP_OP_SET_ELEMENT:
        gp_set(run, number, index, value);
        break;
    case GP_OP_OUTPUT:
        run->out[number] = gp_narrow(value);
        break;
    case GP_OP_FAULT:
        run->fault = value != 0;
        break;
    default:
        break;
    }
}

/* Runs an instruction of the control flow, which enters, skips or repeats the part that it contains. */
static void gp_turn(gp_run_t *run, uint8_t op, uint16_t operand) GS_ON_STACK
{
    GS_ROM uint8_t *image = run->image;
    const bool holds = (run->depth > 0U) && (run->stack[run->depth - 1U] != 0);
    switch (op) {
    case GP_OP_UNLESS:
        --run->depth;
        if (!holds) {
            run->at = (uint16_t)(run->at + gs_u16(image, operand));
        }
        break;
    case GP_OP_ELSE:
        run->at = (uint16_t)(run->at + gs_u16(image, operand));
        break;
    case GP_OP_ANDTHEN:
    case GP_OP_ORELSE:
        if ((op == GP_OP_ORELSE) ? holds : !holds) {
            run->at = (uint16_t)(run->at + gs_u16(image, operand));
        } else {
            --run->depth;
        }
        break;
    case GP_OP_LOOP:
        if (gs_u32(image, operand) == 0U) {
            run->at = (uint16_t)(run->at + gs_u16(image, (uint16_t)(operand + 4U)));
        } else {
            run->rounds[run->loops] = gs_u32(image, operand);
            run->begins[run->loops] = operand;
            ++run->loops;
        }
        break;
    case GP_OP_WHILE:
        --run->depth;
        if (!holds) {
            const uint16_t begins = run->begins[run->loops - 1U];
            run->at = (uint16_t)(begins + 6U + gs_u16(image, (uint16_t)(begins + 4U)));
            --run->loops;
        }
        break;
    default:
        /* AGAIN */
        --run->rounds[run->loops - 1U];
        if (run->rounds[run->loops - 1U] > 0U) {
            run->at = (uint16_t)(run->begins[run->loops - 1U] + 6U);
        } else {
            --run->loops;
        }
        break;
    }
}

void gp_begin(gp_run_t *run, bool reset)
{
    GS_ROM uint8_t *image = run->image;
    const uint16_t first = gp_row(gs_u16(image, GP_AT_CELLS));
    const uint16_t middle = (uint16_t)(first + gs_u16(image, GP_AT_RESET));
    const uint16_t flags = (uint16_t)gp_bytes(gs_u16(image, GP_AT_FLAGS));
    const uint16_t bits = (uint16_t)gp_bytes(gs_u16(image, GP_AT_BITS));
    for (uint16_t i = 0U; i < flags; ++i) {
        run->flags[i] = 0U;
    }
    for (uint16_t i = 0U; i < gs_u16(image, GP_AT_NUMBERS); ++i) {
        run->numbers[i] = 0;
    }
    for (uint8_t i = 0U; i < GP_STACK; ++i) {
        run->stack[i] = 0;
    }
    if (reset) {
        for (uint16_t i = 0U; i < bits; ++i) {
            run->bits[i] = 0U;
        }
        for (uint16_t i = 0U; i < gs_u16(image, GP_AT_VALUES); ++i) {
            run->values[i] = 0;
        }
    }
    run->at = reset ? first : middle;
    run->end = reset ? middle : (uint16_t)(middle + gs_u16(image, GP_AT_REACTION));
    run->number = 0U;
    run->depth = 0U;
    run->loops = 0U;
    run->fault = false;
}

uint8_t gp_go(gp_run_t *run)
{
    uint8_t wants = GP_DONE;
    while ((wants == GP_DONE) && (run->at < run->end)) {
        const uint8_t op = run->image[run->at];
        const uint16_t operand = (uint16_t)(run->at + 1U);
        uint8_t depth = run->depth;
        run->at = (uint16_t)(operand + gp_operand[op]);
        if (op < GP_OP_ELEMENT) {
            run->stack[depth] = gp_leaf(run, op, operand);
            run->depth = (uint8_t)(depth + 1U);
        } else if (op < GP_OP_AND) {
            int64_t *top = &run->stack[depth - 1U];
            if (op == GP_OP_NOT) {
                *top = gp_truth(*top == 0);
            } else if (op == GP_OP_NEG) {
                *top = gp_signed((uint64_t)0U - (uint64_t)*top);
            } else {
                *top = gp_get(run, gs_u16(run->image, operand), *top);
            }
        } else if ((op < GP_OP_SET_BIT) || (op >= GP_OP_BIT_AND)) {
            --depth;
            run->stack[depth - 1U] = gp_two(op, run->stack[depth - 1U], run->stack[depth]);
            run->depth = depth;
        } else if (op < GP_OP_ASK) {
            const uint16_t number = (op == GP_OP_FAULT) ? 0U : gs_u16(run->image, operand);
            --depth;
            if (op == GP_OP_SET_ELEMENT) {
                --depth;
                gp_put_away(run, op, number, run->stack[depth + 1U], run->stack[depth]);
            } else {
                gp_put_away(run, op, number, run->stack[depth], 0);
            }
            run->depth = depth;
        } else if (op < GP_OP_UNLESS) {
            run->number = (op == GP_OP_MICRO) ? 0U : gs_u16(run->image, operand);
            run->depth = 0U;
            wants = (uint8_t)((op - GP_OP_ASK) + GP_ASK);
        } else {
            gp_turn(run, op, operand);
        }
    }
    return wants;
}
