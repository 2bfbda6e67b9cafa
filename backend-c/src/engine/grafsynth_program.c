/* The program engine of grafsynth: the same text for all charts. Do not edit. */
#include "grafsynth_program.h"

/* The virtual machine. */

#define GP_VERSION 2U
#define GP_IMAGE_KIND 4U

/* The header of an image. */
#define GP_AT_BITS 16U
#define GP_AT_VALUES 18U
#define GP_AT_FLAGS 20U
#define GP_AT_NUMBERS 22U
#define GP_AT_CELLS 24U
#define GP_AT_RESET 26U
#define GP_AT_REACTION 28U
#define GP_BODY 32U

/* --- checking ----------------------------------------------------------------------------------------------------------------------------- */

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

static uint16_t gp_many(GS_ROM uint8_t *image, const gp_room_t *room, uint8_t kind)
{
    uint16_t many = 0U;
    switch (kind) {
    case GP_KIND_INPUT:
        many = room->inputs;
        break;
    case GP_KIND_BIT:
        many = gs_u16(image, GP_AT_BITS);
        break;
    case GP_KIND_VALUE:
        many = gs_u16(image, GP_AT_VALUES);
        break;
    case GP_KIND_CELL:
        many = gs_u16(image, GP_AT_CELLS);
        break;
    case GP_KIND_FLAG:
        many = gs_u16(image, GP_AT_FLAGS);
        break;
    case GP_KIND_NUMBER:
        many = gs_u16(image, GP_AT_NUMBERS);
        break;
    case GP_KIND_OUTPUT:
        many = room->outputs;
        break;
    case GP_KIND_CALL:
        many = room->calls;
        break;
    case GP_KIND_TEXT:
        many = room->texts;
        break;
    default:
        many = room->fired;
        break;
    }
    return many;
}

uint8_t gp_check(GS_ROM uint8_t *image, uint16_t size, const gp_room_t *room)
{
    uint8_t found = GS_OK;
    if (size < GP_BODY) {
        found = GS_SHORT;
    } else if ((image[0] != 0x47U) || (image[1] != 0x53U) || (image[2] != 0x54U) || (image[3] != 0x42U)) {
        found = GS_MAGIC;
    } else if ((image[4] != GP_VERSION) || (image[GS_AT_KIND] != GP_IMAGE_KIND)) {
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

/* --- running ------------------------------------------------------------------------------------------------------------------------------ */

void gp_begin(gp_run_t *run, bool reset)
{
    GS_ROM uint8_t *image = run->image;
    const uint16_t first = (uint16_t)(GP_BODY + (GP_CELL_ROW * gs_u16(image, GP_AT_CELLS)));
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
    run->cells = GP_BODY;
    run->at = reset ? first : middle;
    run->end = reset ? middle : (uint16_t)(middle + gs_u16(image, GP_AT_REACTION));
    run->number = 0U;
    run->depth = 0U;
    run->loops = 0U;
    run->fault = false;
}
