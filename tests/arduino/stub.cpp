// Runs a sketch for some passes of its loop, a tenth of a second apart.
#include "Arduino.h"

uint8_t stub_levels[256];
uint8_t stub_modes[256];
unsigned long stub_time = 0;

int main()
{
    setup();
    for (int pass = 0; pass < 100; ++pass) {
        stub_time += 100;
        stub_levels[2] = (uint8_t)(pass % 2);
        loop();
    }
    return 0;
}
