/* Runs a firmware of avr.c in simavr. Usage: avr_host FIRMWARE.elf; prints `mean largest` for each series. */
#include <simavr/sim_avr.h>
#include <simavr/sim_elf.h>
#include <simavr/sim_io.h>
#include <stdio.h>
#include <string.h>

static unsigned long long begin, sum, largest, n;
static int is_done;

static void mark(struct avr_t *avr, avr_io_addr_t address, uint8_t value, void *context)
{
    (void)context;
    avr->data[address] = value;
    if (value == 1) {
        begin = avr->cycle;
    } else if (value == 2) {
        const unsigned long long cycles = avr->cycle - begin;
        sum += cycles;
        largest = cycles > largest ? cycles : largest;
        ++n;
    } else if (value == 4) {
        printf("%.1f %llu\n", n ? (double)sum / (double)n : 0.0, largest);
        sum = largest = n = 0;
    } else if (value == 3) {
        is_done = 1;
    }
}

static void quiet(avr_t *avr, const int level, const char *format, va_list arguments)
{
    (void)avr;
    (void)level;
    (void)format;
    (void)arguments;
}

int main(int argc, char **argv)
{
    elf_firmware_t firmware;
    memset(&firmware, 0, sizeof firmware);
    avr_global_logger_set(quiet);
    avr_t *avr = avr_make_mcu_by_name("atmega1284p");
    if (argc < 2 || avr == NULL || elf_read_firmware(argv[1], &firmware) != 0) {
        return 1;
    }
    avr_init(avr);
    firmware.frequency = 16000000;
    avr_load_firmware(avr, &firmware);
    avr_register_io_write(avr, 0x3e, mark, NULL); /* GPIOR0 */
    while (!is_done) {
        const int state = avr_run(avr);
        if (state == cpu_Done || state == cpu_Crashed) {
            return 1;
        }
    }
    return 0;
}
