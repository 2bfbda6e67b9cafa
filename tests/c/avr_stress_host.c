/* Drives avr_stress.c: edges on PD2 at random phases for a number of cycles, gaps from GAP_LO up to GAP_HI cycles. Prints the edges raised, the cycles,
 * and what the firmware counted. */
#include <simavr/avr_ioport.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_elf.h>
#include <simavr/sim_io.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static uint32_t counts[8];
static unsigned n_bytes;

static void take(struct avr_t *avr, avr_io_addr_t address, uint8_t value, void *parameter)
{
    (void)parameter;
    avr->data[address] = value;
    if (n_bytes < 32U) {
        counts[n_bytes / 4U] |= (uint32_t)value << (8U * (n_bytes % 4U));
        ++n_bytes;
    }
}

int main(int argc, char **argv)
{
    elf_firmware_t firmware;
    memset(&firmware, 0, sizeof firmware);
    if (argc != 5 || elf_read_firmware(argv[1], &firmware) != 0) {
        return 2;
    }
    const uint64_t limit = strtoull(argv[2], NULL, 10);
    const uint64_t lo = strtoull(argv[3], NULL, 10);
    const uint64_t hi = strtoull(argv[4], NULL, 10);
    avr_t *avr = avr_make_mcu_by_name("atmega1284p");
    if (avr == NULL) {
        return 2;
    }
    avr_init(avr);
    avr->frequency = 16000000U;
    avr_load_firmware(avr, &firmware);
    avr_register_io_write(avr, 0x3e, take, NULL);
    avr_irq_t *pin = avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('D'), 2);
    uint64_t random = 88172645463325252U;
    uint64_t next = 20000U;
    uint32_t n_edges = 0U;
    int state = cpu_Running;
    while (state != cpu_Done && state != cpu_Crashed) {
        if (avr->cycle >= next && avr->cycle < limit) {
            ++n_edges;
            avr_raise_irq(pin, n_edges & 1U);
            random ^= random << 13;
            random ^= random >> 7;
            random ^= random << 17;
            next = avr->cycle + lo + random % (hi - lo + 1U);
        }
        /* A while after the last edge, so that its interrupt has come. */
        if (avr->cycle >= limit + 10000U) {
            avr->data[0x4b] = 1U;
        }
        state = avr_run(avr);
    }
    printf("%u %llu", n_edges, (unsigned long long)avr->cycle);
    for (unsigned i = 0; i < 8U; ++i) {
        printf(" %u", counts[i]);
    }
    printf("\n");
    return state == cpu_Done && n_bytes == 32U ? 0 : 1;
}
