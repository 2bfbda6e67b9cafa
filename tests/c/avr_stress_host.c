/* Drives avr_stress.c and avr_isr.c, and prints what they counted. */
#include "avr_host.h"

int main(int argc, char **argv)
{
    avr_t *avr = board(argc, argv);
    return avr == NULL ? 2 : drive(avr, argv, NULL);
}
