/* Runs examples/mcs-frame on an ATmega1284P: the emergency button (PD2) is pressed at cycle STOP and released after 2 ms; the operator's key (PD4) is pressed
 * at cycle KEY for 5 ms. Prints each change of the drives (d), the alarm (a) and the pin that each round toggles (r), with its cycle, until cycle LIMIT. */
#include <simavr/avr_ioport.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_elf.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static avr_t *avr;

static void changed(struct avr_irq_t *irq, uint32_t value, void *name)
{
    if (irq->value != value) {
        printf("%s%u %llu\n", (const char *)name, (unsigned)value, (unsigned long long)avr->cycle);
    }
}

int main(int argc, char **argv)
{
    elf_firmware_t firmware;
    memset(&firmware, 0, sizeof firmware);
    if (argc != 5 || elf_read_firmware(argv[1], &firmware) != 0) {
        return 2;
    }
    const uint64_t stop = strtoull(argv[2], NULL, 10);
    const uint64_t key = strtoull(argv[3], NULL, 10);
    const uint64_t limit = strtoull(argv[4], NULL, 10);
    avr = avr_make_mcu_by_name("atmega1284p");
    if (avr == NULL) {
        return 2;
    }
    avr_init(avr);
    avr->frequency = 16000000U;
    avr_load_firmware(avr, &firmware);
    static char *const names[] = { "d", "a", "r" };
    for (int i = 0; i < 3; ++i) {
        avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('B'), i), changed, names[i]);
    }
    const uint64_t at[] = { 1000U, stop, stop + 32000U, key, key + 80000U, limit };
    avr_irq_t *button = avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('D'), 2);
    avr_irq_t *wire = avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('D'), 3);
    avr_irq_t *operator_key = avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('D'), 4);
    avr_raise_irq(button, 1);
    avr_raise_irq(wire, 1);
    avr_raise_irq(operator_key, 1);
    int state = cpu_Running;
    for (unsigned next = 1; next < 6U; ++next) {
        while (avr->cycle < at[next] && state != cpu_Done && state != cpu_Crashed) {
            state = avr_run(avr);
        }
        if (next == 1U || next == 2U) {
            avr_raise_irq(button, next == 2U);
        } else if (next == 3U || next == 4U) {
            avr_raise_irq(operator_key, next == 4U);
        }
    }
    return state == cpu_Running || state == cpu_Sleeping ? 0 : 1;
}
