// run: check {}
// An assignment in a second pair of parentheses, and loops whose empty body is intended: nothing is reported.
extern volatile _Bool start, stop, top;
volatile _Bool motor, last;

int main(void)
{
    for (;;) {
        while (!start)
            ;
        while (stop);
        motor = 1;
        if ((last = top)) {
        } else
            motor = 0;
        motor = 0;
    }
}
