// run: check {}
// The semicolon after the condition is the whole body: the motor always runs.
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
