/* run: check */
int f(int count)
{
    return coutn + 1;
}
