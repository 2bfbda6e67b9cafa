/* run: check */
int f(int a)
{
    if (a) goto end;
    return 1;
}
