/* run: check */
int f(int a)
{
    return a + ;
}
