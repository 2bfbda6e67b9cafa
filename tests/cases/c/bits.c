/* run: convert {} {out}/bits.graf --int 16 */
/* Bit operators of C become those of the chart; a conversion to a narrower type is a mask. */
#include <stdint.h>
extern volatile uint8_t flags, mask, bit;
extern volatile uint16_t word;
extern volatile int16_t value;
volatile uint8_t low, without, inverted;
volatile uint16_t packed, toggled;
volatile int16_t halved;
volatile int8_t narrowed;

void bits(void)
{
    for (;;) {
        low = flags & 0x0F;
        without = flags & ~mask;
        inverted = ~flags;
        packed = (uint16_t)flags << 8 | mask;
        toggled = word ^ (1u << bit);
        halved = value >> 1;
        narrowed = value;
    }
}
