/* run: check */
int read_sensor(void);
int f(int a)
{
    if (read_sensor() > a) return 1;
    return 0;
}
