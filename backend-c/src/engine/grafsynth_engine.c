/* The table engine of grafsynth: the same text for all charts. Do not edit. */
#include "grafsynth_engine.h"

/* The virtual machine. */

/* The header of an image. */
#define GS_AT_LIMIT 16U
#define GS_AT_CHOSEN 18U
#define GS_AT_INITIAL 20U
#define GS_AT_INPUTS 22U
#define GS_AT_SECTIONS 24U
#define GS_AT_RESET 80U
#define GS_BODY 84U

/* Kind 0: all fireable transitions fire. */
#define GS_PRIORITY 1U
#define GS_INNER 2U
#define GS_OUTER 3U

/* Sections, and the bytes of a row of each. */
#define GS_STATES 0U
#define GS_TRANSITIONS 1U
#define GS_EVENTS 2U
#define GS_INDEX 3U
#define GS_LISTS 4U
#define GS_ITEMS 5U
#define GS_HISTORIES 6U
#define GS_CASES 7U
#define GS_VARS 8U
#define GS_TIMERS 9U
#define GS_EDGES 10U
#define GS_OUTPUTS 11U
#define GS_BLOCKS 12U
#define GS_CODE 13U
#define GS_N_SECTIONS 14U
#define GS_STATE_ROW 12U
#define GS_TRANSITION_ROW 12U
#define GS_EVENT_ROW 6U
#define GS_LIST_ROW 4U
#define GS_HISTORY_ROW 10U
#define GS_CASE_ROW 4U
#define GS_TIMER_ROW 6U
#define GS_BLOCK_ROW 4U

#define GS_NONE 0xFFFFU

/* The kind of a list item: its two highest bits. */
#define GS_ITEM_KIND 0xC000U
#define GS_ITEM_CONTENT 0x4000U
#define GS_ITEM_HISTORY 0x8000U
#define GS_ITEM_NUMBER 0x3FFFU

/* --- reading ------------------------------------------------------------------------------------------------------------------------------ */

static uint16_t gs_count(GS_ROM uint8_t *image, uint8_t section)
{
    return gs_u16(image, (uint16_t)(GS_AT_SECTIONS + (4U * (uint16_t)section) + 2U));
}

static uint16_t gs_row(GS_ROM uint8_t *image, uint8_t section, uint16_t row, uint8_t size)
{
    const uint16_t base = gs_u16(image, (uint16_t)(GS_AT_SECTIONS + (4U * (uint16_t)section)));
    return (uint16_t)(base + (uint16_t)((uint32_t)row * size));
}

/* One column of one row. */
static uint16_t gs_cell(GS_ROM uint8_t *image, uint8_t section, uint16_t row, uint8_t size, uint8_t column)
{
    return gs_u16(image, (uint16_t)(gs_row(image, section, row, size) + column));
}

#define GS_STATE(image, row, column) gs_cell((image), GS_STATES, (row), GS_STATE_ROW, (column))
#define GS_ANCESTOR 0U
#define GS_LAST 2U
#define GS_ENTRY 4U
#define GS_EXIT 6U
#define GS_CONTENT 8U
#define GS_TIMER 10U
#define GS_TRANSITION(image, row, column) gs_cell((image), GS_TRANSITIONS, (row), GS_TRANSITION_ROW, (column))
#define GS_FROM 0U
#define GS_CLEARS_FIRST 2U
#define GS_CLEARS_LAST 4U
#define GS_TO 6U
#define GS_GUARD 8U
#define GS_ACTION 10U

/* --- checking ----------------------------------------------------------------------------------------------------------------------------- */

static const uint8_t gs_row_sizes[GS_N_SECTIONS] = {
    GS_STATE_ROW, GS_TRANSITION_ROW, GS_EVENT_ROW, 2U, GS_LIST_ROW, 2U, GS_HISTORY_ROW, GS_CASE_ROW, GS_CELL_ROW, GS_TIMER_ROW, 2U, 2U,
    GS_BLOCK_ROW, 1U
};

static bool gs_below(uint16_t number, uint16_t count)
{
    return number < count;
}

static bool gs_below_or_none(uint16_t number, uint16_t count)
{
    return (number < count) || (number == GS_NONE);
}

/* Whether `many` rows from `first` on are within `count` rows. */
static bool gs_within(uint16_t first, uint16_t many, uint16_t count)
{
    return (first <= count) && (many <= (uint16_t)(count - first));
}

static uint32_t gs_bytes(uint32_t bits)
{
    return (bits + 7U) >> 3;
}

/* The number of bytes for the marks of a micro-step. The chosen transitions follow them. */
static uint32_t gs_marks(GS_ROM uint8_t *image) GS_ON_STACK
{
    const uint32_t states = gs_count(image, GS_STATES);
    const uint32_t histories = gs_count(image, GS_HISTORIES);
    return gs_bytes((uint32_t)gs_count(image, GS_TRANSITIONS) + (3U * states) + (3U * histories));
}

/* The number of bits: situation, recorded cases, and two for each edge. */
static uint32_t gs_count_bits(GS_ROM uint8_t *image)
{
    return (uint32_t)gs_count(image, GS_STATES) + gs_count(image, GS_CASES) + (2U * (uint32_t)gs_count(image, GS_EDGES));
}

static bool gs_has_room(GS_ROM uint8_t *image, const gs_room_t *room) GS_ON_STACK
{
    const uint32_t values = (uint32_t)gs_count(image, GS_VARS) + gs_count(image, GS_TIMERS);
    const uint32_t work = gs_marks(image) + (2U * (uint32_t)gs_u16(image, GS_AT_CHOSEN));
    return (gs_bytes(gs_count_bits(image)) <= room->bits) && (values <= room->values) && (work <= room->work);
}

static uint16_t gs_many(GS_ROM uint8_t *image, uint8_t kind) GS_ON_STACK
{
    const uint32_t bits = gs_count_bits(image);
    uint32_t many = 0U;
    switch (kind) {
    case GS_KIND_INPUT:
        many = gs_u16(image, GS_AT_INPUTS);
        break;
    case GS_KIND_BIT:
        many = bits;
        break;
    case GS_KIND_PAIR:
        if (bits > 0U) {
            many = bits - 1U;
        }
        break;
    case GS_KIND_VALUE:
        many = (uint32_t)gs_count(image, GS_VARS) + gs_count(image, GS_TIMERS);
        break;
    default:
        many = gs_count(image, GS_VARS);
        break;
    }
    return (many < GS_NONE) ? (uint16_t)many : GS_NONE;
}

/* Whether a block stays within the code and can be run, and leaves the wanted number of values. */
static bool gs_block_is_good(GS_ROM uint8_t *image, uint16_t block, uint8_t wanted)
{
    const uint16_t first = gs_cell(image, GS_BLOCKS, block, GS_BLOCK_ROW, 0U);
    const uint16_t many = gs_cell(image, GS_BLOCKS, block, GS_BLOCK_ROW, 2U);
    bool good = gs_within(first, many, gs_count(image, GS_CODE));
    if (good) {
        const uint16_t at = gs_row(image, GS_CODE, first, 1U);
        good = gs_check_code(image, at, (uint16_t)(at + many), wanted) == GS_OK;
    }
    return good;
}

static bool gs_value_is_good(GS_ROM uint8_t *image, uint16_t block)
{
    return gs_below(block, gs_count(image, GS_BLOCKS)) && gs_block_is_good(image, block, 1U);
}

/* A list of statements; an empty list is block 0, or another block without instructions. */
static bool gs_list_is_good(GS_ROM uint8_t *image, uint16_t block)
{
    return gs_below(block, gs_count(image, GS_BLOCKS)) && gs_block_is_good(image, block, 0U);
}

static bool gs_states_are_good(GS_ROM uint8_t *image)
{
    const uint16_t states = gs_count(image, GS_STATES);
    const uint16_t timers = gs_count(image, GS_TIMERS);
    bool good = states <= GS_ITEM_NUMBER;
    for (uint16_t s = 0U; good && (s < states); ++s) {
        const uint16_t above = GS_STATE(image, s, GS_ANCESTOR);
        const uint16_t last = GS_STATE(image, s, GS_LAST);
        /* Ancestors come first, so every path up ends. */
        good = ((above < s) || (above == GS_NONE)) && (last >= s) && gs_below(last, states)
               && gs_list_is_good(image, GS_STATE(image, s, GS_ENTRY)) && gs_list_is_good(image, GS_STATE(image, s, GS_EXIT))
               && gs_list_is_good(image, GS_STATE(image, s, GS_CONTENT))
               && gs_below_or_none(GS_STATE(image, s, GS_TIMER), timers);
    }
    return good;
}

static bool gs_transitions_are_good(GS_ROM uint8_t *image)
{
    const bool is_chart = image[GS_AT_KIND] >= GS_INNER;
    const uint16_t states = gs_count(image, GS_STATES);
    const uint16_t lists = gs_count(image, GS_LISTS);
    const uint16_t transitions = gs_count(image, GS_TRANSITIONS);
    bool good = true;
    for (uint16_t t = 0U; good && (t < transitions); ++t) {
        const uint16_t first = GS_TRANSITION(image, t, GS_CLEARS_FIRST);
        const uint16_t last = GS_TRANSITION(image, t, GS_CLEARS_LAST);
        const uint16_t guard = GS_TRANSITION(image, t, GS_GUARD);
        good = gs_below(GS_TRANSITION(image, t, GS_FROM), is_chart ? states : lists) && gs_below(GS_TRANSITION(image, t, GS_TO), lists)
               && ((first > last) || gs_below(last, states)) && ((guard == 0U) || gs_value_is_good(image, guard))
               && gs_list_is_good(image, GS_TRANSITION(image, t, GS_ACTION));
    }
    return good;
}

static bool gs_events_are_good(GS_ROM uint8_t *image)
{
    const uint16_t events = gs_count(image, GS_EVENTS);
    const uint16_t index = gs_count(image, GS_INDEX);
    const uint16_t transitions = gs_count(image, GS_TRANSITIONS);
    bool good = events > 0U;
    for (uint16_t e = 0U; good && (e < events); ++e) {
        const uint16_t input = gs_cell(image, GS_EVENTS, e, GS_EVENT_ROW, 0U);
        const uint16_t first = gs_cell(image, GS_EVENTS, e, GS_EVENT_ROW, 2U);
        const uint16_t many = gs_cell(image, GS_EVENTS, e, GS_EVENT_ROW, 4U);
        good = ((e == 0U) || gs_below(input, gs_u16(image, GS_AT_INPUTS))) && gs_within(first, many, index);
    }
    for (uint16_t i = 0U; good && (i < index); ++i) {
        good = gs_below(gs_cell(image, GS_INDEX, i, 2U, 0U), transitions);
    }
    return good;
}

static bool gs_lists_are_good(GS_ROM uint8_t *image)
{
    const bool is_chart = image[GS_AT_KIND] >= GS_INNER;
    const uint16_t lists = gs_count(image, GS_LISTS);
    const uint16_t items = gs_count(image, GS_ITEMS);
    bool good = gs_below(gs_u16(image, GS_AT_INITIAL), lists);
    for (uint16_t l = 0U; good && (l < lists); ++l) {
        good = gs_within(gs_cell(image, GS_LISTS, l, GS_LIST_ROW, 0U), gs_cell(image, GS_LISTS, l, GS_LIST_ROW, 2U), items);
    }
    for (uint16_t i = 0U; good && (i < items); ++i) {
        const uint16_t item = gs_cell(image, GS_ITEMS, i, 2U, 0U);
        const uint16_t kind = item & GS_ITEM_KIND;
        const bool is_state = (kind == 0U) || (is_chart && (kind == GS_ITEM_CONTENT));
        const bool is_history = is_chart && (kind == GS_ITEM_HISTORY);
        good = (is_state || is_history) && gs_below(item & GS_ITEM_NUMBER, gs_count(image, is_state ? GS_STATES : GS_HISTORIES));
    }
    return good;
}

static bool gs_histories_are_good(GS_ROM uint8_t *image)
{
    const uint16_t histories = gs_count(image, GS_HISTORIES);
    const uint16_t cases = gs_count(image, GS_CASES);
    bool good = histories <= GS_ITEM_NUMBER;
    for (uint16_t h = 0U; good && (h < histories); ++h) {
        const uint16_t row = gs_row(image, GS_HISTORIES, h, GS_HISTORY_ROW);
        good = gs_below(gs_u16(image, row), gs_count(image, GS_STATES))
               && gs_within(gs_u16(image, (uint16_t)(row + 2U)), gs_u16(image, (uint16_t)(row + 4U)), cases)
               && gs_below(gs_u16(image, (uint16_t)(row + 6U)), gs_count(image, GS_LISTS))
               && gs_list_is_good(image, gs_u16(image, (uint16_t)(row + 8U)));
    }
    for (uint16_t c = 0U; good && (c < cases); ++c) {
        good = gs_below(gs_cell(image, GS_CASES, c, GS_CASE_ROW, 0U), gs_count(image, GS_STATES))
               && gs_below(gs_cell(image, GS_CASES, c, GS_CASE_ROW, 2U), gs_count(image, GS_LISTS));
    }
    return good;
}

static bool gs_rest_is_good(GS_ROM uint8_t *image) GS_ON_STACK
{
    const uint32_t values = (uint32_t)gs_count(image, GS_VARS) + gs_count(image, GS_TIMERS);
    bool good = gs_list_is_good(image, gs_u16(image, GS_AT_RESET));
    for (uint16_t v = 0U; good && (v < gs_count(image, GS_VARS)); ++v) {
        const uint16_t row = gs_row(image, GS_VARS, v, GS_CELL_ROW);
        const uint32_t last = (uint32_t)gs_u16(image, row) + gs_u16(image, (uint16_t)(row + 2U));
        const int32_t least = gs_i32(image, (uint16_t)(row + 4U));
        good = (gs_u16(image, (uint16_t)(row + 2U)) > 0U) && (last <= values) && (least <= gs_i32(image, (uint16_t)(row + 8U)));
    }
    for (uint16_t t = 0U; good && (t < gs_count(image, GS_TIMERS)); ++t) {
        const uint16_t row = gs_row(image, GS_TIMERS, t, GS_TIMER_ROW);
        good = gs_below(gs_u16(image, row), gs_count(image, GS_STATES)) && (gs_i32(image, (uint16_t)(row + 2U)) >= 0);
    }
    for (uint16_t e = 0U; good && (e < gs_count(image, GS_EDGES)); ++e) {
        good = gs_value_is_good(image, gs_cell(image, GS_EDGES, e, 2U, 0U));
    }
    for (uint16_t o = 0U; good && (o < gs_count(image, GS_OUTPUTS)); ++o) {
        good = gs_value_is_good(image, gs_cell(image, GS_OUTPUTS, o, 2U, 0U));
    }
    return good;
}

static bool gs_sections_are_good(GS_ROM uint8_t *image, uint16_t length) GS_ON_STACK
{
    bool good = true;
    for (uint8_t section = 0U; good && (section < GS_N_SECTIONS); ++section) {
        const uint32_t from = gs_row(image, section, 0U, 1U);
        const uint32_t bytes = (uint32_t)gs_count(image, section) * gs_row_sizes[section];
        good = (from >= GS_BODY) && ((from + bytes) <= length);
    }
    return good;
}

uint8_t gs_check(GS_ROM uint8_t *image, uint16_t size, const gs_room_t *room)
{
    uint8_t found = GS_OK;
    if (size < GS_BODY) {
        found = GS_SHORT;
    } else if ((image[0] != 0x47U) || (image[1] != 0x53U) || (image[2] != 0x54U) || (image[3] != 0x42U)) {
        found = GS_MAGIC;
    } else if (image[4] != 2U) {
        found = GS_VERSION;
    } else if ((gs_u16(image, GS_AT_LENGTH) > size) || (gs_u16(image, GS_AT_LENGTH) < GS_BODY)) {
        found = GS_SHORT;
    } else if (gs_crc(image, gs_u16(image, GS_AT_LENGTH)) != gs_u32(image, GS_AT_CRC)) {
        found = GS_CRC;
    } else if ((gs_u32(image, GS_AT_INTERFACE) != room->interface) || (gs_u16(image, GS_AT_INPUTS) != room->inputs)
               || (gs_count(image, GS_OUTPUTS) != room->outputs)) {
        found = GS_INTERFACE;
    } else if ((image[GS_AT_KIND] > GS_OUTER) || !gs_sections_are_good(image, gs_u16(image, GS_AT_LENGTH))) {
        found = GS_RANGE;
    } else if (!gs_has_room(image, room)) {
        found = GS_ROOM;
    } else if ((gs_count(image, GS_BLOCKS) == 0U) || !gs_states_are_good(image) || !gs_transitions_are_good(image)
               || !gs_events_are_good(image) || !gs_lists_are_good(image) || !gs_histories_are_good(image) || !gs_rest_is_good(image)) {
        found = GS_RANGE;
    } else {
        /* valid */
    }
    return found;
}

/* --- bits --------------------------------------------------------------------------------------------------------------------------------- */

/* The positions of recorded cases and edges, after the situation. */
static uint16_t gs_case_bit(const gs_run_t *run, uint16_t number)
{
    return (uint16_t)(gs_count(run->image, GS_STATES) + number);
}

/* The operand of an edge before this reaction; the next bit is its value now. Once a transition has fired, both are equal, so no edge remains. */
static uint16_t gs_edge_bit(const gs_run_t *run, uint16_t number)
{
    return (uint16_t)(gs_case_bit(run, gs_count(run->image, GS_CASES)) + (2U * (uint32_t)number));
}

/* Marks of a micro-step: transition offered; state exited, entered, runs its initial content; history pending, visited, takes its default. */
static uint16_t gs_exit_mark(const gs_run_t *run)
{
    return gs_count(run->image, GS_TRANSITIONS);
}

static uint16_t gs_enter_mark(const gs_run_t *run)
{
    return (uint16_t)(gs_exit_mark(run) + gs_count(run->image, GS_STATES));
}

static uint16_t gs_content_mark(const gs_run_t *run)
{
    return (uint16_t)(gs_enter_mark(run) + gs_count(run->image, GS_STATES));
}

static uint16_t gs_history_mark(const gs_run_t *run, uint16_t which)
{
    const uint16_t histories = gs_count(run->image, GS_HISTORIES);
    return (uint16_t)(gs_content_mark(run) + gs_count(run->image, GS_STATES) + (uint16_t)((uint32_t)which * histories));
}

static void gs_clear_marks(gs_run_t *run)
{
    const uint16_t bytes = (uint16_t)gs_marks(run->image);
    for (uint16_t i = 0U; i < bytes; ++i) {
        run->work[i] = 0U;
    }
    run->chosen = 0U;
}

static uint16_t gs_chosen(const gs_run_t *run, uint16_t at) GS_ON_STACK
{
    const uint16_t place = (uint16_t)(gs_marks(run->image) + (2U * (uint32_t)at));
    const uint16_t low = run->work[place];
    const uint16_t high = run->work[place + 1U];
    return (uint16_t)(low | (uint16_t)(high << 8));
}

static void gs_set_chosen(gs_run_t *run, uint16_t at, uint16_t transition) GS_ON_STACK
{
    const uint16_t place = (uint16_t)(gs_marks(run->image) + (2U * (uint32_t)at));
    run->work[place] = (uint8_t)(transition & 0xFFU);
    run->work[place + 1U] = (uint8_t)(transition >> 8);
}

/* --- expressions and lists ---------------------------------------------------------------------------------------------------------------- */

/* The result of a block; 0 for a statement list. */
static int32_t gs_run(gs_run_t *run, uint16_t block)
{
    run->cells = gs_row(run->image, GS_VARS, 0U, GS_CELL_ROW);
    run->at = gs_row(run->image, GS_CODE, gs_cell(run->image, GS_BLOCKS, block, GS_BLOCK_ROW, 0U), 1U);
    run->end = (uint16_t)(run->at + gs_cell(run->image, GS_BLOCKS, block, GS_BLOCK_ROW, 2U));
    run->depth = 0U;
    run->stack[0] = 0;
    gs_go(run);
    return run->stack[0];
}

/* --- a micro-step ------------------------------------------------------------------------------------------------------------------------- */

static void gs_set_active(gs_run_t *run, uint16_t state, bool active)
{
    const uint16_t timer = GS_STATE(run->image, state, GS_TIMER);
    gs_put(run->bits, state, active);
    if (timer != GS_NONE) {
        run->values[(uint16_t)(gs_count(run->image, GS_VARS) + timer)] = 0;
    }
}

/* Marks the entries of a list. */
static void gs_add(gs_run_t *run, uint16_t list)
{
    const uint16_t first = gs_cell(run->image, GS_LISTS, list, GS_LIST_ROW, 0U);
    const uint16_t many = gs_cell(run->image, GS_LISTS, list, GS_LIST_ROW, 2U);
    for (uint16_t i = 0U; i < many; ++i) {
        const uint16_t item = gs_cell(run->image, GS_ITEMS, (uint16_t)(first + i), 2U, 0U);
        const uint16_t kind = item & GS_ITEM_KIND;
        const uint16_t number = item & GS_ITEM_NUMBER;
        if (kind == GS_ITEM_HISTORY) {
            if (!gs_bit(run->work, (uint16_t)(gs_history_mark(run, 1U) + number))) {
                gs_put(run->work, (uint16_t)(gs_history_mark(run, 1U) + number), true);
                gs_put(run->work, (uint16_t)(gs_history_mark(run, 0U) + number), true);
            }
        } else if (kind == GS_ITEM_CONTENT) {
            gs_put(run->work, (uint16_t)(gs_content_mark(run) + number), true);
        } else {
            gs_put(run->work, (uint16_t)(gs_enter_mark(run) + number), true);
        }
    }
}

/* Enters what a history recorded or, if nothing is recorded, its default. */
static void gs_enter_history(gs_run_t *run, uint16_t history) GS_ON_STACK
{
    const uint16_t row = gs_row(run->image, GS_HISTORIES, history, GS_HISTORY_ROW);
    const uint16_t first = gs_u16(run->image, (uint16_t)(row + 2U));
    const uint16_t many = gs_u16(run->image, (uint16_t)(row + 4U));
    bool recorded = false;
    for (uint16_t c = 0U; c < many; ++c) {
        if (gs_bit(run->bits, gs_case_bit(run, (uint16_t)(first + c)))) {
            recorded = true;
            gs_add(run, gs_cell(run->image, GS_CASES, (uint16_t)(first + c), GS_CASE_ROW, 2U));
        }
    }
    if (!recorded) {
        gs_put(run->work, (uint16_t)(gs_history_mark(run, 2U) + history), true);
        gs_add(run, gs_u16(run->image, (uint16_t)(row + 6U)));
    }
}

/* Each history is entered at most once, so this terminates. */
static void gs_enter_histories(gs_run_t *run)
{
    const uint16_t histories = gs_count(run->image, GS_HISTORIES);
    bool again = histories > 0U;
    while (again) {
        again = false;
        for (uint16_t h = 0U; h < histories; ++h) {
            const uint16_t waits = (uint16_t)(gs_history_mark(run, 0U) + h);
            if (gs_bit(run->work, waits)) {
                gs_put(run->work, waits, false);
                gs_enter_history(run, h);
                again = true;
            }
        }
    }
}

static void gs_record_histories(gs_run_t *run) GS_ON_STACK
{
    for (uint16_t h = 0U; h < gs_count(run->image, GS_HISTORIES); ++h) {
        const uint16_t row = gs_row(run->image, GS_HISTORIES, h, GS_HISTORY_ROW);
        const uint16_t owner = gs_u16(run->image, row);
        if (gs_bit(run->work, (uint16_t)(gs_exit_mark(run) + owner))) {
            const uint16_t first = gs_u16(run->image, (uint16_t)(row + 2U));
            const uint16_t many = gs_u16(run->image, (uint16_t)(row + 4U));
            for (uint16_t c = 0U; c < many; ++c) {
                const uint16_t state = gs_cell(run->image, GS_CASES, (uint16_t)(first + c), GS_CASE_ROW, 0U);
                gs_put(run->bits, gs_case_bit(run, (uint16_t)(first + c)), gs_bit(run->bits, state));
            }
        }
    }
}

/* Activates the marked states, outermost first. */
static void gs_enter_states(gs_run_t *run)
{
    const uint16_t histories = gs_count(run->image, GS_HISTORIES);
    for (uint16_t s = 0U; s < gs_count(run->image, GS_STATES); ++s) {
        if (gs_bit(run->work, (uint16_t)(gs_enter_mark(run) + s))) {
            gs_set_active(run, s, true);
            (void)gs_run(run, GS_STATE(run->image, s, GS_ENTRY));
            if (gs_bit(run->work, (uint16_t)(gs_content_mark(run) + s))) {
                (void)gs_run(run, GS_STATE(run->image, s, GS_CONTENT));
            }
            for (uint16_t h = 0U; h < histories; ++h) {
                const uint16_t row = gs_row(run->image, GS_HISTORIES, h, GS_HISTORY_ROW);
                if (gs_bit(run->work, (uint16_t)(gs_history_mark(run, 2U) + h)) && (gs_u16(run->image, row) == s)) {
                    (void)gs_run(run, gs_u16(run->image, (uint16_t)(row + 8U)));
                }
            }
        }
    }
}

/* Fires the chosen transitions of a statechart: exits innermost first, actions, entries. */
static void gs_fire_chart(gs_run_t *run)
{
    for (uint16_t i = 0U; i < run->chosen; ++i) {
        const uint16_t t = gs_chosen(run, i);
        const uint16_t last = GS_TRANSITION(run->image, t, GS_CLEARS_LAST);
        for (uint32_t s = GS_TRANSITION(run->image, t, GS_CLEARS_FIRST); s <= last; ++s) {
            if (gs_bit(run->bits, (uint16_t)s)) {
                gs_put(run->work, (uint16_t)(gs_exit_mark(run) + s), true);
            }
        }
    }
    gs_record_histories(run);
    for (uint16_t i = 0U; i < run->chosen; ++i) {
        gs_add(run, GS_TRANSITION(run->image, gs_chosen(run, i), GS_TO));
    }
    gs_enter_histories(run);
    for (uint16_t s = gs_count(run->image, GS_STATES); s > 0U; --s) {
        const uint16_t state = (uint16_t)(s - 1U);
        if (gs_bit(run->work, (uint16_t)(gs_exit_mark(run) + state))) {
            (void)gs_run(run, GS_STATE(run->image, state, GS_EXIT));
            gs_set_active(run, state, false);
        }
    }
    for (uint16_t i = 0U; i < run->chosen; ++i) {
        (void)gs_run(run, GS_TRANSITION(run->image, gs_chosen(run, i), GS_ACTION));
    }
    gs_enter_states(run);
}

/* Ends all edges. */
static void gs_renew_edges(gs_run_t *run) GS_ON_STACK
{
    for (uint16_t e = 0U; e < gs_count(run->image, GS_EDGES); ++e) {
        const uint16_t before = gs_edge_bit(run, e);
        gs_put(run->bits, before, gs_bit(run->bits, (uint16_t)(before + 1U)));
    }
}

static bool gs_guard_holds(gs_run_t *run, uint16_t transition)
{
    const uint16_t guard = GS_TRANSITION(run->image, transition, GS_GUARD);
    return (guard == 0U) || (gs_run(run, guard) != 0);
}

/* Whether a state is inside another. */
static bool gs_lies_in(const gs_run_t *run, uint16_t state, uint16_t outer)
{
    return (state > outer) && (state <= GS_STATE(run->image, outer, GS_LAST));
}

/* Chooses a transition if it precedes all chosen ones that exit some of the same states; removes these. */
static void gs_take(gs_run_t *run, uint16_t transition) GS_ON_STACK
{
    GS_ROM uint8_t *image = run->image;
    const bool inner = image[GS_AT_KIND] == GS_INNER;
    const uint16_t first = GS_TRANSITION(image, transition, GS_CLEARS_FIRST);
    const uint16_t last = GS_TRANSITION(image, transition, GS_CLEARS_LAST);
    const uint16_t from = GS_TRANSITION(image, transition, GS_FROM);
    bool wins = true;
    for (uint8_t pass = 0U; pass < 2U; ++pass) {
        uint16_t kept = 0U;
        for (uint16_t i = 0U; wins && (i < run->chosen); ++i) {
            const uint16_t other = gs_chosen(run, i);
            const uint16_t other_first = GS_TRANSITION(image, other, GS_CLEARS_FIRST);
            const uint16_t other_last = GS_TRANSITION(image, other, GS_CLEARS_LAST);
            const bool meets = (first <= last) && (other_first <= other_last) && (first <= other_last) && (other_first <= last);
            if (pass == 0U) {
                const uint16_t other_from = GS_TRANSITION(image, other, GS_FROM);
                const bool before = inner ? gs_lies_in(run, from, other_from) : gs_lies_in(run, other_from, from);
                wins = !meets || before;
            } else if (!meets) {
                gs_set_chosen(run, kept, other);
                ++kept;
            } else {
                /* removed */
            }
        }
        if (wins && (pass == 1U)) {
            run->chosen = kept;
        }
    }
    if (wins && (run->chosen < gs_u16(image, GS_AT_CHOSEN))) {
        gs_set_chosen(run, run->chosen, transition);
        ++run->chosen;
    }
}

/* The first fireable transition on an event from a state. */
static uint16_t gs_first(gs_run_t *run, uint16_t event, uint16_t state)
{
    const uint16_t first = gs_cell(run->image, GS_EVENTS, event, GS_EVENT_ROW, 2U);
    const uint16_t many = gs_cell(run->image, GS_EVENTS, event, GS_EVENT_ROW, 4U);
    uint16_t found = GS_NONE;
    for (uint16_t i = 0U; (found == GS_NONE) && (i < many); ++i) {
        const uint16_t t = gs_cell(run->image, GS_INDEX, (uint16_t)(first + i), 2U, 0U);
        if ((GS_TRANSITION(run->image, t, GS_FROM) == state) && gs_guard_holds(run, t)) {
            found = t;
        }
    }
    return found;
}

/* Chooses the transitions of a statechart that fire on an event (0: no event). */
static void gs_check_chart(gs_run_t *run, uint16_t event)
{
    const bool inner = run->image[GS_AT_KIND] == GS_INNER;
    gs_clear_marks(run);
    if (gs_cell(run->image, GS_EVENTS, event, GS_EVENT_ROW, 4U) > 0U) {
        for (uint16_t s = 0U; s < gs_count(run->image, GS_STATES); ++s) {
            if ((GS_STATE(run->image, s, GS_LAST) == s) && gs_bit(run->bits, s)) {
                uint16_t offered = GS_NONE;
                uint16_t up = s;
                while ((up != GS_NONE) && (!inner || (offered == GS_NONE))) {
                    const uint16_t found = gs_first(run, event, up);
                    offered = (found != GS_NONE) ? found : offered;
                    up = GS_STATE(run->image, up, GS_ANCESTOR);
                }
                if ((offered != GS_NONE) && !gs_bit(run->work, offered)) {
                    gs_put(run->work, offered, true);
                    gs_take(run, offered);
                }
            }
        }
    }
}

/* Micro-steps of a statechart until nothing fires and no event is left. */
static bool gs_evolve_chart(gs_run_t *run, bool reset)
{
    const uint16_t limit = gs_u16(run->image, GS_AT_LIMIT);
    const uint16_t events = gs_count(run->image, GS_EVENTS);
    uint16_t next = reset ? events : 1U;
    uint16_t n = 0U;
    bool fault = false;
    bool again = true;
    while (again) {
        gs_check_chart(run, 0U);
        if (run->chosen == 0U) {
            while ((next < events) && (run->in[gs_cell(run->image, GS_EVENTS, next, GS_EVENT_ROW, 0U)] == 0)) {
                ++next;
            }
            again = next < events;
            if (again) {
                n = 0U;
                gs_check_chart(run, next);
                ++next;
            }
        }
        if (run->chosen > 0U) {
            if (n == limit) {
                fault = true;
                again = false;
            } else {
                gs_fire_chart(run);
                gs_renew_edges(run);
                ++n;
            }
        }
    }
    return fault;
}

/* Chooses the transitions of a net: all fireable ones, or the first of those that share a step. */
static bool gs_check_net(gs_run_t *run) GS_ON_STACK
{
    const bool competes = run->image[GS_AT_KIND] == GS_PRIORITY;
    bool any = false;
    gs_clear_marks(run);
    for (uint16_t t = 0U; t < gs_count(run->image, GS_TRANSITIONS); ++t) {
        const uint16_t list = GS_TRANSITION(run->image, t, GS_FROM);
        const uint16_t first = gs_cell(run->image, GS_LISTS, list, GS_LIST_ROW, 0U);
        const uint16_t many = gs_cell(run->image, GS_LISTS, list, GS_LIST_ROW, 2U);
        bool fires = true;
        for (uint16_t i = 0U; fires && (i < many); ++i) {
            const uint16_t step = gs_cell(run->image, GS_ITEMS, (uint16_t)(first + i), 2U, 0U);
            fires = gs_bit(run->bits, step) && !(competes && gs_bit(run->work, (uint16_t)(gs_exit_mark(run) + step)));
        }
        if (fires && gs_guard_holds(run, t)) {
            any = true;
            gs_put(run->work, t, true);
            for (uint16_t i = 0U; i < many; ++i) {
                const uint16_t step = gs_cell(run->image, GS_ITEMS, (uint16_t)(first + i), 2U, 0U);
                gs_put(run->work, (uint16_t)(gs_exit_mark(run) + step), true);
            }
        }
    }
    return any;
}

/* Fires the chosen transitions of a net; a step that is both left and entered stays active. */
static void gs_fire_net(gs_run_t *run)
{
    const uint16_t states = gs_count(run->image, GS_STATES);
    const uint16_t transitions = gs_count(run->image, GS_TRANSITIONS);
    for (uint16_t t = 0U; t < transitions; ++t) {
        if (gs_bit(run->work, t)) {
            gs_add(run, GS_TRANSITION(run->image, t, GS_TO));
        }
    }
    for (uint16_t s = 0U; s < states; ++s) {
        const uint16_t enters = (uint16_t)(gs_enter_mark(run) + s);
        const bool stays = gs_bit(run->work, enters) && gs_bit(run->bits, s);
        if (stays) {
            gs_put(run->work, enters, false);
        } else if (gs_bit(run->work, (uint16_t)(gs_exit_mark(run) + s))) {
            (void)gs_run(run, GS_STATE(run->image, s, GS_EXIT));
            gs_set_active(run, s, false);
        } else {
            /* neither */
        }
    }
    for (uint16_t t = 0U; t < transitions; ++t) {
        if (gs_bit(run->work, t)) {
            (void)gs_run(run, GS_TRANSITION(run->image, t, GS_ACTION));
        }
    }
    gs_enter_states(run);
}

static bool gs_evolve_net(gs_run_t *run)
{
    const uint16_t limit = gs_u16(run->image, GS_AT_LIMIT);
    uint16_t n = 0U;
    bool fault = false;
    bool again = gs_check_net(run);
    while (again) {
        if ((limit != 0U) && (n == limit)) {
            fault = true;
            again = false;
        } else {
            gs_fire_net(run);
            gs_renew_edges(run);
            ++n;
            again = (limit != 0U) && gs_check_net(run);
        }
    }
    return fault;
}

/* --- reactions ---------------------------------------------------------------------------------------------------------------------------- */

/* Edge operands read inputs only, so they are constant during a reaction. */
static void gs_compare_edges(gs_run_t *run) GS_ON_STACK
{
    for (uint16_t e = 0U; e < gs_count(run->image, GS_EDGES); ++e) {
        gs_put(run->bits, (uint16_t)(gs_edge_bit(run, e) + 1U), gs_run(run, gs_cell(run->image, GS_EDGES, e, 2U, 0U)) != 0);
    }
}

static void gs_give_outputs(gs_run_t *run) GS_ON_STACK
{
    for (uint16_t o = 0U; o < gs_count(run->image, GS_OUTPUTS); ++o) {
        run->out[o] = gs_run(run, gs_cell(run->image, GS_OUTPUTS, o, 2U, 0U));
    }
}

bool gs_init(gs_run_t *run)
{
    GS_ROM uint8_t *image = run->image;
    const uint16_t values = (uint16_t)(gs_count(image, GS_VARS) + gs_count(image, GS_TIMERS));
    const uint16_t bits = gs_edge_bit(run, gs_count(image, GS_EDGES));
    bool fault = false;
    for (uint16_t i = 0U; i < bits; ++i) {
        gs_put(run->bits, i, false);
    }
    for (uint16_t v = 0U; v < values; ++v) {
        run->values[v] = 0;
    }
    (void)gs_run(run, gs_u16(image, GS_AT_RESET));
    gs_clear_marks(run);
    gs_add(run, gs_u16(image, GS_AT_INITIAL));
    gs_enter_histories(run);
    gs_enter_states(run);
    if (image[GS_AT_KIND] >= GS_INNER) {
        gs_compare_edges(run);
        fault = gs_evolve_chart(run, true);
        gs_renew_edges(run);
    }
    gs_give_outputs(run);
    return fault;
}

bool gs_step(gs_run_t *run, int32_t dt)
{
    GS_ROM uint8_t *image = run->image;
    const uint16_t vars = gs_count(image, GS_VARS);
    int32_t ticks = dt;
    bool fault;
    if (dt < 0) {
        ticks = 0x7FFFFFFF;
    }
    for (uint16_t t = 0U; t < gs_count(image, GS_TIMERS); ++t) {
        const uint16_t row = gs_row(image, GS_TIMERS, t, GS_TIMER_ROW);
        if (gs_bit(run->bits, gs_u16(image, row))) {
            const int32_t cap = gs_i32(image, (uint16_t)(row + 2U));
            const int32_t now = run->values[(uint16_t)(vars + t)];
            const int32_t rest = cap - now;
            int32_t then = cap;
            if (ticks < rest) {
                then = now + ticks;
            }
            run->values[(uint16_t)(vars + t)] = then;
        }
    }
    gs_compare_edges(run);
    if (image[GS_AT_KIND] >= GS_INNER) {
        fault = gs_evolve_chart(run, false);
    } else {
        fault = gs_evolve_net(run);
    }
    gs_renew_edges(run);
    gs_give_outputs(run);
    return fault;
}
