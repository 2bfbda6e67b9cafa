/* run: convert {} {out}/program.graf --int 16 */
/* A program without an end: its inputs and outputs are the volatile variables that it only reads or writes. */
#include <stdint.h>
volatile _Bool start, stop;
volatile uint8_t speed = 10;

int main(void)
{
    uint16_t turns = 0;

    for (;;) {
        while (!start)
            ;
        do {
            speed += 5;
            turns++;
        } while (!stop && speed < 200);
        speed = turns > 1000u ? 0 : 10;
    }
}
