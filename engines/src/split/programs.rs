//! The texts in C that connect the CPU of a split with its board. Messages are those of [`crate::tools::converse`].

use grafsynth_split::cpu::Family;

/// A register is written.
pub(super) const WRITE: u8 = 1;
/// A register is read; the answer is its value.
pub(super) const READ: u8 = 2;
/// The bench sends a byte.
pub(super) const PUT: u8 = 3;
/// The bench asks for a byte.
pub(super) const GET: u8 = 4;

/// The port of the bench for a family. `name` is the prefix of the link.
pub(super) fn port(family: Family, name: &str) -> String {
    match family {
        Family::Avr => crate::avr::PORT.to_owned(),
        Family::Stm32f1 => format!("{HEAD}{SEMIHOSTING}{MESSAGES}{REGISTERS}{TAIL}"),
        Family::Host | Family::Mcs51 => {
            format!("{HEAD}{STANDARD}{MESSAGES}{}{TAIL}", FUNCTIONS.replace("NAME", name))
        }
    }
}

/// A header that is read before `NAME_link_pins.h`: it turns accesses of registers into calls.
pub(super) fn accesses(name: &str) -> String {
    format!(
        "#include <stdint.h>\nvolatile uint32_t *bench_register(uint32_t at);\n#define {}_LINK_REG(address) (*bench_register(address))\n",
        name.to_uppercase()
    )
}

const HEAD: &str = "#ifndef BENCH_PORT_H
#define BENCH_PORT_H

#include <stdbool.h>
#include <stdint.h>
";

const TAIL: &str = "
static uint8_t bench_get(void)
{
    bench_flush();
    return (uint8_t)bench_send_message(4U, 0U, 0U, true);
}

static void bench_put(uint8_t value)
{
    bench_flush();
    (void)bench_send_message(3U, 0U, value, false);
}

#endif
";

/// Standard input and output of a program on this computer.
const STANDARD: &str = "#include <stdio.h>

static void bench_begin(void)
{
}

static void bench_out(const uint8_t *bytes, uint32_t n)
{
    (void)fwrite(bytes, 1U, n, stdout);
}

static void bench_in(uint8_t *bytes, uint32_t n)
{
    (void)fflush(stdout);
    (void)fread(bytes, 1U, n, stdin);
}

static void bench_end(void)
{
    (void)fflush(stdout);
}
";

/// Standard input and output of qemu, by semihosting. Operation numbers: Arm, *Semihosting for AArch32 and AArch64*, §6.
const SEMIHOSTING: &str = r#"static uint32_t bench_files[2];
static uint8_t bench_buffer[252];
static uint32_t bench_n;

static uint32_t bench_call(uint32_t operation, const volatile void *argument)
{
    register uint32_t r0 __asm__("r0") = operation;
    register const volatile void *r1 __asm__("r1") = argument;
    __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
    return r0;
}

static uint32_t bench_open(const char *name, uint32_t length, uint32_t mode)
{
    const volatile uint32_t block[3] = { (uint32_t)(uintptr_t)name, mode, length };
    return bench_call(0x01U, block);
}

static void bench_begin(void)
{
    bench_files[0] = bench_open("/dev/stdin", 10U, 1U);
    bench_files[1] = bench_open("/dev/stdout", 11U, 5U);
}

static void bench_send_all(void)
{
    const volatile uint32_t block[3] = { bench_files[1], (uint32_t)(uintptr_t)bench_buffer, bench_n };
    if (bench_n != 0U) {
        (void)bench_call(0x05U, block);
    }
    bench_n = 0U;
}

static void bench_out(const uint8_t *bytes, uint32_t n)
{
    if (bench_n + n > sizeof bench_buffer) {
        bench_send_all();
    }
    while (n-- > 0U) {
        bench_buffer[bench_n++] = *bytes++;
    }
}

static void bench_in(uint8_t *bytes, uint32_t n)
{
    uint32_t rest = n;
    bench_send_all();
    while (rest != 0U) {
        const volatile uint32_t block[3] = { bench_files[0], (uint32_t)(uintptr_t)&bytes[n - rest], rest };
        const uint32_t missing = bench_call(0x06U, block);
        if (missing == rest) {
            (void)bench_call(0x18U, (const volatile void *)0x20023);
        }
        rest = missing;
    }
}

static void bench_end(void)
{
    bench_send_all();
    (void)bench_call(0x18U, (const volatile void *)0x20026);
}
"#;

/// One message, and its answer.
const MESSAGES: &str = "
static uint32_t bench_send_message(uint8_t kind, uint32_t at, uint32_t value, bool is_question)
{
    uint8_t bytes[9];
    uint32_t i;
    bytes[0] = kind;
    for (i = 0U; i < 4U; ++i) {
        bytes[1U + i] = (uint8_t)(at >> (8U * i));
        bytes[5U + i] = (uint8_t)(value >> (8U * i));
    }
    bench_out(bytes, 9U);
    if (!is_question) {
        return 0U;
    }
    bench_in(bytes, 4U);
    return (uint32_t)bytes[0] | (uint32_t)bytes[1] << 8 | (uint32_t)bytes[2] << 16 | (uint32_t)bytes[3] << 24;
}
";

/// The functions that a link on this computer needs.
const FUNCTIONS: &str = "
void NAME_link_host_put(unsigned pin, bool level);
bool NAME_link_host_get(unsigned pin);
void NAME_link_host_settle(void);

void NAME_link_host_put(unsigned pin, bool level)
{
    (void)bench_send_message(1U, pin, level ? 1U : 0U, false);
}

bool NAME_link_host_get(unsigned pin)
{
    return bench_send_message(2U, pin, 0U, true) != 0U;
}

void NAME_link_host_settle(void)
{
}

static void bench_flush(void)
{
}
";

/// Registers as a cell in memory: it is filled before each access, and what was written into it is sent before the next one.
const REGISTERS: &str = "
static volatile uint32_t bench_cell;
static uint32_t bench_before;
static uint32_t bench_at;

volatile uint32_t *bench_register(uint32_t at);

static void bench_flush(void)
{
    const uint32_t value = bench_cell;
    if (value != bench_before) {
        bench_before = value;
        (void)bench_send_message(1U, bench_at, value, false);
    }
}

volatile uint32_t *bench_register(uint32_t at)
{
    bench_flush();
    bench_at = at;
    bench_before = bench_send_message(2U, at, 0U, true);
    bench_cell = bench_before;
    return &bench_cell;
}
";

/// The host of an AVR around libsimavr, after [`crate::simavr`]'s part: accesses of ports become messages. Arguments: the machine, the firmware, the frequency, the
/// addresses of GPIOR0 and GPIOR1, and for each port its letter with the address of PIN; DDR and PORT follow it.
pub(super) const SIMAVR: &str = r#"#include <simavr/sim_avr.h>
#include <simavr/sim_elf.h>
#include <simavr/sim_io.h>
#include <simavr/avr_ioport.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

/* The simulator prints to standard output, which is redirected to standard error here. */
static FILE *messages;

static uint32_t message(int kind, uint32_t at, uint32_t value, int is_question)
{
    uint8_t bytes[9] = { (uint8_t)kind };
    for (unsigned i = 0; i < 4; ++i) {
        bytes[1 + i] = (uint8_t)(at >> (8 * i));
        bytes[5 + i] = (uint8_t)(value >> (8 * i));
    }
    fwrite(bytes, 1, 9, messages);
    if (!is_question) {
        return 0;
    }
    fflush(messages);
    if (fread(bytes, 1, 4, stdin) != 4) {
        exit(3);
    }
    return (uint32_t)bytes[0] | (uint32_t)bytes[1] << 8 | (uint32_t)bytes[2] << 16 | (uint32_t)bytes[3] << 24;
}

/* A port: its letter, and the functions of the simulator for PIN, DDR and PORT. */
struct port {
    uint32_t letter;
    avr_io_addr_t pin;
    avr_io_read_t read;
    void *of_read;
    avr_io_write_t write[2];
    void *of_write[2];
};

static uint8_t read_pin(struct avr_t *avr, avr_io_addr_t address, void *parameter)
{
    const struct port *port = parameter;
    const uint32_t levels = message(2, port->letter << 8 | 2U, 0, 1);
    for (int bit = 0; bit < 8; ++bit) {
        avr_raise_irq(avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ((char)port->letter), bit), levels >> bit & 1U);
    }
    return port->read(avr, address, port->of_read);
}

static void write_port(struct avr_t *avr, avr_io_addr_t address, uint8_t value, void *parameter)
{
    const struct port *port = parameter;
    const int is_port = address == port->pin + 2;
    port->write[is_port](avr, address, value, port->of_write[is_port]);
    message(1, port->letter << 8 | (is_port ? 0U : 1U), value, 0);
}

static uint8_t give(struct avr_t *avr, avr_io_addr_t address, void *parameter)
{
    (void)avr;
    (void)address;
    (void)parameter;
    return (uint8_t)message(4, 0, 0, 1);
}

static void take(struct avr_t *avr, avr_io_addr_t address, uint8_t value, void *parameter)
{
    (void)parameter;
    avr->data[address] = value;
    message(3, 0, value, 0);
}

int main(int argc, char **argv)
{
    static elf_firmware_t firmware;
    static struct port ports[8];
    messages = fdopen(dup(STDOUT_FILENO), "wb");
    if (messages == NULL || dup2(STDERR_FILENO, STDOUT_FILENO) < 0) {
        return 2;
    }
    if (argc < 6 || argc > 14 || elf_read_firmware(argv[2], &firmware) != 0) {
        return 2;
    }
    avr_t *avr = avr_make_mcu_by_name(argv[1]);
    if (avr == NULL) {
        return 2;
    }
    avr_init(avr);
    avr->frequency = (uint32_t)strtoul(argv[3], NULL, 10);
    avr_load_firmware(avr, &firmware);
    avr_register_io_write(avr, (avr_io_addr_t)strtoul(argv[4], NULL, 16), take, NULL);
    avr_register_io_read(avr, (avr_io_addr_t)strtoul(argv[5], NULL, 16), give, NULL);
    for (int at = 6; at < argc; ++at) {
        struct port *port = &ports[at - 6];
        port->letter = (uint8_t)argv[at][0];
        port->pin = (avr_io_addr_t)strtoul(argv[at] + 1, NULL, 16);
        const int io = AVR_DATA_TO_IO(port->pin);
        port->read = avr->io[io].r.c;
        port->of_read = avr->io[io].r.param;
        for (int which = 0; which < 2; ++which) {
            port->write[which] = avr->io[io + 1 + which].w.c;
            port->of_write[which] = avr->io[io + 1 + which].w.param;
            avr->io[io + 1 + which].w.c = write_port;
            avr->io[io + 1 + which].w.param = port;
        }
        if (port->read == NULL || port->write[0] == NULL || port->write[1] == NULL) {
            return 2;
        }
        avr->io[io].r.c = read_pin;
        avr->io[io].r.param = port;
    }
    int state = cpu_Running;
    while (state != cpu_Done && state != cpu_Crashed) {
        state = avr_run(avr);
    }
    fflush(messages);
    return state == cpu_Done ? 0 : 1;
}
"#;
