/* --- the virtual machine ------------------------------------------------------------------------------------------------------------------ */

/* What an entry of the table above means. */
#define GC_GIVES(use) ((uint8_t)((use) & 1U))
#define GC_TAKES(use) ((uint8_t)(((use) >> 1) & 3U))
#define GC_SIZE(use) ((uint8_t)(((use) >> 8) & 15U))
#define GC_KIND(use) ((uint8_t)(((use) >> 4) & 15U))
#define GC_CLASS(use) ((uint8_t)((use) >> 12))

/* The maximum number of parts that are open at once. */
#define GC_NEST 32U
/* The size of the row of a cell, in bytes: its first number and its number of numbers (16 bits each), its minimum and its maximum (32 bits each). */
#define GC_CELL_ROW 12U

/* The number of objects of a kind that operands can refer to. */
/* wide: */
static uint16_t gc_many(GS_ROM uint8_t *image, const gc_room_t *room, uint8_t kind);
/* :wide */
/* narrow: */
static uint16_t gc_many(GS_ROM uint8_t *image, uint8_t kind) GS_ON_STACK;
/* :narrow */

typedef struct {
/* wide: */
    uint32_t rounds; /* maximum, multiplied by those of all enclosing loops */
/* :wide */
    uint16_t end;
    uint8_t kind;  /* the instruction that opened it */
    uint8_t depth; /* stack depth at its end; for UNLESS at its start */
} gc_region_t;

/* Whether a part of the code stays within its bytes and its stack, and leaves the right number of values. Every part that is skipped or repeated is
   contained in an instruction, is closed within the one around it, and leaves the stack as deep as skipping it does; so one pass from first to last
   checks everything. */
/* wide: */
static uint8_t gc_check_code(GS_ROM uint8_t *image, const gc_room_t *room, uint16_t first, uint16_t end)
/* :wide */
/* narrow: */
static uint8_t gc_check_code(GS_ROM uint8_t *image, uint16_t first, uint16_t end, uint8_t wanted)
/* :narrow */
{
    gc_region_t open[GC_NEST];
    uint8_t found = GS_OK;
    uint16_t at = first;
    uint8_t n = 1U;
    uint8_t depth = 0U;
/* wide: */
    uint8_t loops = 0U;
    open[0].rounds = 1U;
/* :wide */
    open[0].end = end;
    open[0].kind = GC_N_OPS;
    open[0].depth = 0U;
    while ((found == GS_OK) && (at < end)) {
        const uint8_t op = image[at];
        const uint16_t operand = (uint16_t)(at + 1U);
        const uint16_t use = (op < GC_N_OPS) ? gc_use[op] : 0U;
        bool good = use != 0U;
/* wide: */
        bool again = op == GC_OP_AGAIN;
/* :wide */
        gc_region_t inner;
        inner = open[n - 1U];
        if (good) {
            good = (GC_SIZE(use) < (uint16_t)(inner.end - at)) && (GC_TAKES(use) <= depth);
            at = (uint16_t)(operand + GC_SIZE(use));
            depth = (uint8_t)((uint8_t)(depth - GC_TAKES(use)) + GC_GIVES(use));
        }
        good = good && (depth <= GC_STACK);
        if (good && (GC_KIND(use) < GC_KINDS)) {
/* wide: */
            good = gs_u16(image, operand) < gc_many(image, room, GC_KIND(use));
/* :wide */
/* narrow: */
            good = gs_u16(image, operand) < gc_many(image, GC_KIND(use));
/* :narrow */
        }
/* wide: */
        if (good && (GC_CLASS(use) == GC_SERVICE)) {
            /* A call pops all values; the others need an empty stack. */
            good = depth == ((op == GC_OP_CALL) ? image[(uint16_t)(operand + 2U)] : 0U);
            depth = 0U;
        }
        if (good && (op == GC_OP_AGAIN)) {
            good = (inner.kind == GC_OP_LOOP) && (at == inner.end);
        } else if (good && (op == GC_OP_WHILE)) {
            good = (inner.kind == GC_OP_LOOP) && (depth == 0U);
        } else if (good && (GC_CLASS(use) == GC_CONTROL)) {
/* :wide */
/* narrow: */
        if (good && (GC_CLASS(use) == GC_CONTROL)) {
/* :narrow */
            gc_region_t next;
            uint16_t far = gs_u16(image, operand);
            next = inner;
            next.kind = op;
            next.depth = depth;
            if (op == GC_OP_ELSE) {
                good = (inner.kind == GC_OP_UNLESS) && (at == inner.end);
                depth = inner.depth;
                if (good) {
                    --n;
                }
/* wide: */
            } else if (op == GC_OP_LOOP) {
                const uint32_t limit = gs_u32(image, operand);
                far = gs_u16(image, (uint16_t)(operand + 4U));
                good = (depth == 0U) && (loops < GC_LOOPS) && (far > 0U);
                if (good && (limit > (room->rounds / inner.rounds))) {
                    found = GS_ROOM;
                }
                next.rounds = (limit > 0U) ? (inner.rounds * limit) : inner.rounds;
                ++loops;
            } else if (op != GC_OP_UNLESS) {
                /* The deciding value stays on the stack if the rest is skipped. */
                ++next.depth;
/* :wide */
            } else {
                /* UNLESS */
            }
            good = good && (n < GC_NEST) && (far <= (uint16_t)(open[n - 1U].end - at));
            if (good) {
                next.end = (uint16_t)(at + far);
                open[n] = next;
                ++n;
            }
        } else {
            /* checked */
        }
        /* Parts that end here; the outermost ends with the code. */
        while (good && (n > 1U) && (open[n - 1U].end == at)) {
/* wide: */
            if (open[n - 1U].kind == GC_OP_LOOP) {
                /* A loop must end with AGAIN. */
                good = again && (depth == 0U);
                again = false;
                --loops;
            } else {
                good = open[n - 1U].depth == depth;
            }
/* :wide */
/* narrow: */
            good = open[n - 1U].depth == depth;
/* :narrow */
            --n;
        }
        if (!good) {
            found = GS_RANGE;
        }
    }
/* wide: */
    if ((found == GS_OK) && ((n != 1U) || (depth != 0U))) {
/* :wide */
/* narrow: */
    if ((found == GS_OK) && ((n != 1U) || (depth != wanted))) {
/* :narrow */
        found = GS_RANGE;
    }
    return found;
}

/* wide: */
/* Interprets a number as two's complement, on every machine. */
static int64_t gc_signed(uint64_t value) GS_ON_STACK
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

static uint64_t gc_magnitude(int64_t value) GS_ON_STACK
{
    return (value < 0) ? ((uint64_t)0U - (uint64_t)value) : (uint64_t)value;
}

/* sdcc for the 8051 adds, shifts and compares 64-bit numbers, but its library lacks other operations. */
#if defined(__SDCC_mcs51)
static uint64_t gc_mul(uint64_t a, uint64_t b) GS_ON_STACK
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

static uint64_t gc_div(uint64_t a, uint64_t b, bool wants_rest) GS_ON_STACK
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
static uint64_t gc_mul(uint64_t a, uint64_t b) GS_ON_STACK
{
    return a * b;
}

static uint64_t gc_div(uint64_t a, uint64_t b, bool wants_rest) GS_ON_STACK
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
static int64_t gc_divide(int64_t a, int64_t b, bool wants_rest) GS_ON_STACK
{
    int64_t value = 0;
    if (b != 0) {
        const uint64_t size = gc_div(gc_magnitude(a), gc_magnitude(b), wants_rest);
        const bool differs = (a < 0) ? (b > 0) : (b < 0);
        const bool is_negative = wants_rest ? (a < 0) : differs;
        value = gc_signed(is_negative ? ((uint64_t)0U - size) : size);
    }
    return value;
}

/* The amount of a shift, limited to 0..63: a damaged image may contain any value. */
static uint8_t gc_amount(int64_t by) GS_ON_STACK
{
    return (uint8_t)((uint64_t)by & 63U);
}

/* Rounds down: the complement of a negative number is shifted. */
static int64_t gc_shift_right(int64_t a, uint8_t by) GS_ON_STACK
{
    const uint64_t flip = (a < 0) ? UINT64_MAX : (uint64_t)0U;
    return gc_signed((((uint64_t)a ^ flip) >> by) ^ flip);
}

/* :wide */
static gc_number_t gc_truth(bool value) GS_ON_STACK
{
    return value ? 1 : 0;
}

static gc_number_t gc_two(uint8_t op, gc_number_t a, gc_number_t b)
{
    gc_number_t value = 0;
    switch (op) {
    case GC_OP_AND:
        value = gc_truth((a != 0) && (b != 0));
        break;
    case GC_OP_OR:
        value = gc_truth((a != 0) || (b != 0));
        break;
    case GC_OP_EQ:
        value = gc_truth(a == b);
        break;
    case GC_OP_NE:
        value = gc_truth(a != b);
        break;
    case GC_OP_LT:
        value = gc_truth(a < b);
        break;
    case GC_OP_LE:
        value = gc_truth(a <= b);
        break;
    case GC_OP_GT:
        value = gc_truth(a > b);
        break;
    case GC_OP_GE:
        value = gc_truth(a >= b);
        break;
    case GC_OP_ADD:
        value = gc_signed((gc_word_t)a + (gc_word_t)b);
        break;
    case GC_OP_SUB:
        value = gc_signed((gc_word_t)a - (gc_word_t)b);
        break;
    case GC_OP_MUL:
/* wide: */
        value = gc_signed(gc_mul((gc_word_t)a, (gc_word_t)b));
/* :wide */
/* narrow: */
        value = gc_signed((gc_word_t)a * (gc_word_t)b);
/* :narrow */
        break;
/* wide: */
    case GC_OP_DIV:
        value = gc_divide(a, b, false);
        break;
    case GC_OP_MOD:
        value = gc_divide(a, b, true);
        break;
    case GC_OP_BIT_AND:
        value = gc_signed((gc_word_t)a & (gc_word_t)b);
        break;
    case GC_OP_BIT_OR:
        value = gc_signed((gc_word_t)a | (gc_word_t)b);
        break;
    case GC_OP_BIT_XOR:
        value = gc_signed((gc_word_t)a ^ (gc_word_t)b);
        break;
    case GC_OP_SHL:
        value = gc_signed((gc_word_t)a << gc_amount(b));
        break;
    case GC_OP_SHR:
        value = gc_shift_right(a, gc_amount(b));
        break;
/* :wide */
    default:
        break;
    }
    return value;
}

static uint16_t gc_cell_row(const gc_run_t *run, uint16_t cell)
{
    return (uint16_t)(run->cells + (GC_CELL_ROW * cell));
}

/* wide: */
/* An element of a cell; 0 if it does not exist. */
static int64_t gc_get(const gc_run_t *run, uint16_t cell, int64_t index) GS_ON_STACK
{
    const uint16_t row = gc_cell_row(run, cell);
    const uint16_t first = gs_u16(run->image, row);
    int64_t value = 0;
    if ((index >= 0) && (index < (int64_t)gs_u16(run->image, (uint16_t)(row + 2U)))) {
        value = run->values[first + (uint16_t)index];
    }
    return value;
}

/* :wide */
/* The nearest value in a range. */
static int32_t gc_clamp(gc_number_t value, int32_t least, int32_t most) GS_ON_STACK
{
    int32_t kept;
    if (value < (gc_number_t)least) {
        kept = least;
    } else if (value > (gc_number_t)most) {
        kept = most;
    } else {
        kept = (int32_t)value;
    }
    return kept;
}

/* Stores a value in a cell, limited to the range of the cell; `row` is the row of the cell in the image. */
static void gc_set(const gc_run_t *run, uint16_t row, uint16_t at, gc_number_t value) GS_ON_STACK
{
    run->values[at] = gc_clamp(value, gs_i32(run->image, (uint16_t)(row + 4U)), gs_i32(run->image, (uint16_t)(row + 8U)));
}

/* wide: */
/* Stores into an element of a cell; does nothing if the element does not exist. */
static void gc_set_element(const gc_run_t *run, uint16_t cell, int64_t index, int64_t value) GS_ON_STACK
{
    const uint16_t row = gc_cell_row(run, cell);
    if ((index >= 0) && (index < (int64_t)gs_u16(run->image, (uint16_t)(row + 2U)))) {
        gc_set(run, row, (uint16_t)(gs_u16(run->image, row) + (uint16_t)index), value);
    }
}

/* :wide */
static gc_number_t gc_leaf(const gc_run_t *run, uint8_t op, uint16_t at) GS_ON_STACK
{
    GS_ROM uint8_t *image = run->image;
    gc_number_t value = 0;
    switch (op) {
    case GC_OP_BYTE:
        value = (image[at] < 128U) ? (gc_number_t)image[at] : ((gc_number_t)image[at] - 256);
        break;
    case GC_OP_LONG:
        value = gs_i32(image, at);
        break;
    case GC_OP_INPUT:
        value = run->in[gs_u16(image, at)];
        break;
    case GC_OP_BIT:
        value = gc_truth(gs_bit(run->bits, gs_u16(image, at)));
        break;
    case GC_OP_VALUE:
        value = run->values[gs_u16(image, at)];
        break;
/* narrow: */
    case GC_OP_RISE:
        value = gc_truth(!gs_bit(run->bits, gs_u16(image, at)) && gs_bit(run->bits, (uint16_t)(gs_u16(image, at) + 1U)));
        break;
    case GC_OP_FALL:
        value = gc_truth(gs_bit(run->bits, gs_u16(image, at)) && !gs_bit(run->bits, (uint16_t)(gs_u16(image, at) + 1U)));
        break;
/* :narrow */
/* wide: */
    case GC_OP_WIDE:
        value = gc_signed(((uint64_t)gs_u32(image, (uint16_t)(at + 4U)) << 32) | gs_u32(image, at));
        break;
    case GC_OP_DT:
        value = (int64_t)run->dt;
        break;
    case GC_OP_FLAG:
        value = gc_truth(gs_bit(run->flags, gs_u16(image, at)));
        break;
    case GC_OP_NUMBER:
        value = run->numbers[gs_u16(image, at)];
        break;
/* :wide */
    default:
        break;
    }
    return value;
}

/* wide: */
/* Stores a value. Only SET_ELEMENT uses the index. */
static void gc_put_away(gc_run_t *run, uint8_t op, uint16_t number, int64_t value, int64_t index) GS_ON_STACK
{
    switch (op) {
    case GC_OP_SET_VALUE:
        gc_set_element(run, number, 0, value);
        break;
    case GC_OP_SET_BIT:
        gs_put(run->bits, number, value != 0);
        break;
    case GC_OP_SET_FLAG:
        gs_put(run->flags, number, value != 0);
        break;
    case GC_OP_SET_NUMBER:
        run->numbers[number] = value;
        break;
    case GC_OP_SET_ELEMENT:
        gc_set_element(run, number, index, value);
        break;
    case GC_OP_OUTPUT:
        run->out[number] = gc_clamp(value, (int32_t)INT32_MIN, INT32_MAX);
        break;
    case GC_OP_FAULT:
        run->fault = value != 0;
        break;
    default:
        break;
    }
}

/* :wide */
/* Runs an instruction of the control flow, which enters, skips or repeats the part that it contains. */
static void gc_turn(gc_run_t *run, uint8_t op, uint16_t operand) GS_ON_STACK
{
    GS_ROM uint8_t *image = run->image;
    const bool holds = (run->depth > 0U) && (run->stack[run->depth - 1U] != 0);
    switch (op) {
    case GC_OP_UNLESS:
        --run->depth;
        if (!holds) {
            run->at = (uint16_t)(run->at + gs_u16(image, operand));
        }
        break;
/* wide: */
    case GC_OP_ANDTHEN:
    case GC_OP_ORELSE:
        if ((op == GC_OP_ORELSE) ? holds : !holds) {
            run->at = (uint16_t)(run->at + gs_u16(image, operand));
        } else {
            --run->depth;
        }
        break;
    case GC_OP_LOOP:
        if (gs_u32(image, operand) == 0U) {
            run->at = (uint16_t)(run->at + gs_u16(image, (uint16_t)(operand + 4U)));
        } else {
            run->rounds[run->loops] = gs_u32(image, operand);
            run->begins[run->loops] = operand;
            ++run->loops;
        }
        break;
    case GC_OP_WHILE:
        --run->depth;
        if (!holds) {
            const uint16_t begins = run->begins[run->loops - 1U];
            run->at = (uint16_t)(begins + 6U + gs_u16(image, (uint16_t)(begins + 4U)));
            --run->loops;
        }
        break;
    case GC_OP_AGAIN:
        --run->rounds[run->loops - 1U];
        if (run->rounds[run->loops - 1U] > 0U) {
            run->at = (uint16_t)(run->begins[run->loops - 1U] + 6U);
        } else {
            --run->loops;
        }
        break;
/* :wide */
    default:
        /* ELSE */
        run->at = (uint16_t)(run->at + gs_u16(image, operand));
        break;
    }
}

/* wide: */
uint8_t gc_go(gc_run_t *run)
{
    uint8_t wants = GC_DONE;
    while ((wants == GC_DONE) && (run->at < run->end)) {
/* :wide */
/* narrow: */
/* Runs the code to its end. */
static void gc_go(gc_run_t *run)
{
    while (run->at < run->end) {
/* :narrow */
        const uint8_t op = run->image[run->at];
        const uint16_t operand = (uint16_t)(run->at + 1U);
        const uint16_t use = gc_use[op];
        const uint8_t kind = GC_CLASS(use);
        uint8_t depth = run->depth;
        run->at = (uint16_t)(operand + GC_SIZE(use));
        if (kind == GC_LEAF) {
            run->stack[depth] = gc_leaf(run, op, operand);
            run->depth = (uint8_t)(depth + 1U);
        } else if (kind == GC_ONE) {
            gc_number_t *top = &run->stack[depth - 1U];
            if (op == GC_OP_NOT) {
                *top = gc_truth(*top == 0);
/* wide: */
            } else if (op == GC_OP_ELEMENT) {
                *top = gc_get(run, gs_u16(run->image, operand), *top);
/* :wide */
            } else {
                *top = gc_signed((gc_word_t)0U - (gc_word_t)*top);
            }
        } else if (kind == GC_TWO) {
            --depth;
            run->stack[depth - 1U] = gc_two(op, run->stack[depth - 1U], run->stack[depth]);
            run->depth = depth;
        } else if (kind == GC_STORE) {
            --depth;
/* wide: */
            const uint16_t number = (op == GC_OP_FAULT) ? 0U : gs_u16(run->image, operand);
            const int64_t value = run->stack[depth];
            int64_t index = 0;
            if (op == GC_OP_SET_ELEMENT) {
                --depth;
                index = run->stack[depth];
            }
            gc_put_away(run, op, number, value, index);
/* :wide */
/* narrow: */
            const uint16_t row = gc_cell_row(run, gs_u16(run->image, operand));
            gc_set(run, row, gs_u16(run->image, row), run->stack[depth]);
/* :narrow */
            run->depth = depth;
/* wide: */
        } else if (kind == GC_SERVICE) {
            run->number = (op == GC_OP_MICRO) ? 0U : gs_u16(run->image, operand);
            run->depth = 0U;
            wants = (uint8_t)((op - GC_OP_ASK) + GC_ASK);
/* :wide */
        } else {
            gc_turn(run, op, operand);
        }
    }
/* wide: */
    return wants;
/* :wide */
}
