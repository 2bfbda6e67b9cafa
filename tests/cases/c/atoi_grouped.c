/* run: convert {} {out}/atoi.graf --group comments --fuse */
atoi ( s , return_int ) /* convert s to integer */
char s[];
int *return_int;
{
    int i , n , sign;

    /* skip white space */
    i = 0;
    while (s[i]==' ' || s[i]=='\n' || s[i]=='\t')
        i++;

    /* set sign */
    sign = 1;
    if (s[i] == '+' || s[i] == '-')
        sign = (s[i]=='+') ? 1 : -1;

    /* read_number */
    for ( n=0 ; s[i] >= '0' && s[i] <= '9'; i++)
        n = 10 * n + s[i] - '0';

    /* set return */
    *return_int = sign * n;
}
