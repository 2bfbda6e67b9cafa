/* run: check */
int f(int i)
{
    i = i++ + 1;
    return i;
}
