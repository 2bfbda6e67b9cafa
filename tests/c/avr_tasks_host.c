/* Drives avr_tasks.c. After the line of counts it prints a line for each task: how often it ran, its longest run without interrupts, its longest run with
 * interrupts and their number, and the maximum number of interrupts in a run. Then a line for the interrupts: the maximum time from a pin's edge to its handler, the
 * longest handler, and the maximum time that one takes from a task. Then a line for the step: the reactions with tasks, and the longest time of their tasks alone. */
#include "avr_host.h"

#define TASKS 8U

static uint64_t begun;
static unsigned inside;
static uint64_t raised_at;
static uint64_t isr_begun;
static uint64_t longest_latency;
static uint64_t longest_isr;
static struct {
    uint64_t runs;
    uint64_t alone;
    uint64_t with;
    unsigned most;
    unsigned most_inside;
} tasks[TASKS];
static uint64_t step_own;
static uint64_t longest_step;
static uint64_t budget_runs;

static void mark(struct avr_t *avr, avr_io_addr_t address, uint8_t value, void *parameter)
{
    (void)parameter;
    avr->data[address] = value;
    const uint64_t now = avr->cycle;
    if (value >= 0x10U && value < 0x10U + TASKS) {
        begun = now;
        inside = 0U;
    } else if (value >= 0x20U && value < 0x20U + TASKS) {
        const unsigned task = value - 0x20U;
        const uint64_t length = now - begun;
        ++tasks[task].runs;
        if (inside == 0U) {
            if (length > tasks[task].alone) {
                tasks[task].alone = length;
            }
            step_own += length;
        } else {
            if (length > tasks[task].with) {
                tasks[task].with = length;
                tasks[task].most_inside = inside;
            }
            if (inside > tasks[task].most) {
                tasks[task].most = inside;
            }
            /* Its own share is the time that it takes without interrupts. */
            step_own += tasks[task].alone;
        }
    } else if (value == 1U || value == 2U) {
        ++inside;
        isr_begun = now;
        if (value == 2U && raised_at != 0U) {
            if (now - raised_at > longest_latency) {
                longest_latency = now - raised_at;
            }
            raised_at = 0U;
        }
    } else if (value == 3U) {
        if (now - isr_begun > longest_isr) {
            longest_isr = now - isr_begun;
        }
    } else if (value == 0x40U) {
        if (step_own > 0U) {
            ++budget_runs;
        }
        if (step_own > longest_step) {
            longest_step = step_own;
        }
        step_own = 0U;
    }
}

int main(int argc, char **argv)
{
    avr_t *avr = board(argc, argv);
    if (avr == NULL) {
        return 2;
    }
    avr_register_io_write(avr, 0x4a, mark, NULL);
    const int answer = drive(avr, argv, &raised_at);
    for (unsigned task = 1U; task < TASKS; ++task) {
        if (tasks[task].runs != 0U) {
            printf("task %u %llu %llu %llu %u %u\n", task, (unsigned long long)tasks[task].runs,
                   (unsigned long long)tasks[task].alone, (unsigned long long)tasks[task].with, tasks[task].most_inside,
                   tasks[task].most);
        }
    }
    uint64_t per_interrupt = 0U;
    for (unsigned task = 1U; task < TASKS; ++task) {
        const unsigned n = tasks[task].most_inside;
        if (n != 0U && (tasks[task].with - tasks[task].alone + n - 1U) / n > per_interrupt) {
            per_interrupt = (tasks[task].with - tasks[task].alone + n - 1U) / n;
        }
    }
    printf("interrupts %llu %llu %llu\n", (unsigned long long)longest_latency, (unsigned long long)longest_isr,
           (unsigned long long)per_interrupt);
    printf("step %llu %llu\n", (unsigned long long)budget_runs, (unsigned long long)longest_step);
    return answer;
}
