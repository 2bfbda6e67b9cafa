/* run: convert {} {out}/statements.graf */
/* Each construct of NBSIR 88-3741 once. */
int statements(int a, int b)
{
    int x = 0, i;

    ;
    x = 1;
    if (a > b) goto NEXT;
    x = 2;
NEXT: x = x * 10;

    if (a == 3)
        x += 1;
    if (b == 4)
        x += 2;
    else
        x += 3;

    while (a > 0) {
        a--;
        if (a == 7) break;
        x++;
    }
    do {
        b--;
        if (b == 2) continue;
        x += 100;
    } while (b > 0);
    i = 0;
    for (;;) {
        if (i >= 3) break;
        i++;
    }
    for (i = 0; i < 4; i++) {
        if (i == 2) continue;
        x += 1000;
    }
    switch (x % 4) {
    case 0: x += 5;
    case 1: x += 6;
    default: x += 7;
    }
    switch (x % 3) {
    case 0: x -= 1; break;
    case 1: x -= 2; break;
    }
    return x;
}
