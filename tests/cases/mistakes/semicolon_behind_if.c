// run: check {}
// The semicolon behind the condition is its whole body: the motor always runs.
extern volatile _Bool start, stop, top;
volatile _Bool motor;

int main(void)
{
    for (;;) {
        if (start && !top);
            motor = 1;
        while (motor) {
            if (stop || top)
                motor = 0;
        }
    }
}
