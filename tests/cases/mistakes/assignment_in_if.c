// run: check {}
// One `=` is missing: the condition assigns.
#include <stdbool.h>
extern volatile bool start, stop, top;
volatile bool motor;

int main(void)
{
    for (;;) {
        while (!start)
            ;
        motor = true;
        while (!top) {
            if (stop = 1)
                break;
        }
        motor = false;
    }
}
