/* Drives a firmware on an ATmega1284P in simavr: edges on PD2 at random phases for a number of cycles, with gaps of GAP_LO to GAP_HI cycles. Then
 * GPIOR2 tells the firmware to stop, and it sends eight counts of four bytes to GPIOR0. Arguments: the firmware, the cycles, GAP_LO, GAP_HI. */
#ifndef AVR_HOST_H
#define AVR_HOST_H

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

/* The machine with its firmware, or NULL. */
static avr_t *board(int argc, char **argv)
{
    static elf_firmware_t firmware;
    if (argc != 5 || elf_read_firmware(argv[1], &firmware) != 0) {
        return NULL;
    }
    avr_t *avr = avr_make_mcu_by_name("atmega1284p");
    if (avr != NULL) {
        avr_init(avr);
        avr->frequency = 16000000U;
        avr_load_firmware(avr, &firmware);
        avr_register_io_write(avr, 0x3e, take, NULL);
    }
    return avr;
}

/* Runs the firmware to its end and prints a line: the edges raised, the cycles, and the firmware's counts. If `raised_at` is not NULL, it is set to the cycle of
 * each edge before the edge is raised. Returns 0 if the firmware reached its end. */
static int drive(avr_t *avr, char **argv, uint64_t *raised_at)
{
    const uint64_t limit = strtoull(argv[2], NULL, 10);
    const uint64_t lo = strtoull(argv[3], NULL, 10);
    const uint64_t hi = strtoull(argv[4], NULL, 10);
    avr_irq_t *pin = avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('D'), 2);
    uint64_t random = 88172645463325252U;
    uint64_t next = 20000U;
    uint32_t n_edges = 0U;
    int state = cpu_Running;
    while (state != cpu_Done && state != cpu_Crashed) {
        if (avr->cycle >= next && avr->cycle < limit) {
            ++n_edges;
            if (raised_at != NULL) {
                *raised_at = avr->cycle;
            }
            avr_raise_irq(pin, n_edges & 1U);
            random ^= random << 13;
            random ^= random >> 7;
            random ^= random << 17;
            next = avr->cycle + lo + random % (hi - lo + 1U);
        }
        /* Some time after the last edge, so that its interrupt has already occurred. */
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

#endif
