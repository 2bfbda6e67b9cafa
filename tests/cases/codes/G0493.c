/* run: check */
int f(char s[])
{
    return s[0];
}
