/*
 * The cycle of a machining cell: a robot that loads blanks, a mill with four
 * tools, a washing station and a buffer for finished parts.
 *
 * The host sends telegrams of twelve bytes; each makes the cell run one cycle
  * with the sensor readings of that moment. The variables below keep their
 * values between cycles (wear, buffer, counters).
 *
 *   telegram   0xA5, opcode, eight bytes of data, sequence number, CRC-8
 *   result     0 done, below 0 refused, above 0 stopped on the way
 */
#define SYNC        0xA5
#define N_TOOLS     4
#define N_BUFFER    6
#define MAX_PASSES  9
#define WEAR_LIMIT  2400

enum opcode { OP_NONE, OP_LOAD, OP_MILL, OP_WASH, OP_UNLOAD, OP_CHANGE, OP_REPORT, OP_STOP = 0x7f };
enum fault { OK = 0, E_SYNC = -1, E_CRC = -2, E_OPCODE = -3, E_REPEAT = -4,
             E_EMPTY = 1, E_FULL, E_VIBRATION, E_WEAR, E_GUARD, E_PRESSURE };

static unsigned short wear[N_TOOLS];             /* tenths of a minute each tool has cut */
static signed char buffer[N_BUFFER];             /* sizes of the parts in the buffer, sorted */
static int n_buffer;
static int tool;                                 /* in the spindle */
static int loaded;                               /* size of the blank in the vice, 0 for none */
static unsigned char last_sequence = 255;
static unsigned parts_total;

static const unsigned char hardness[N_TOOLS] = { 12, 7, 20, 15 };
static const short feeds[3][4] = {
    { 120, 90, 60, 30 },
    { 200, 160, 110, 70 },
    { 320, 250, 180, 100 },
};

/* CRC-8 with the polynomial x^8 + x^2 + x + 1, most significant bit first. */
unsigned char crc8(const unsigned char data[12], int length)
{
    unsigned char crc = 0;
    int i, bit;

    for (i = 0; i < length; i++) {
        crc ^= data[i];
        for (bit = 0; bit < 8; bit++)
            crc = crc & 0x80 ? (crc << 1) ^ 0x07 : crc << 1;
    }
    return crc;
}

/* The middle one of three readings. */
int median(a, b, c)
int a, b, c;
{
    if (a > b) {
        int swap = a;
        a = b;
        b = swap;
    }
    if (c <= a)
        return a;
    return c >= b ? b : c;
}

int clamp(int value, int least, int most)
{
    return value < least ? least : value > most ? most : value;
}

/* Integer square root by Newton's method. */
unsigned root(unsigned n)
{
    unsigned x, next;

    if (n < 2)
        return n;
    x = n / 2 + 1;
    for (;;) {
        next = (x + n / x) >> 1;
        if (next >= x)
            return x;
        x = next;
    }
}

/* Two decimal digits in one byte, as the panel shows them. */
unsigned char bcd(unsigned n)
{
    n %= 100;
    return (unsigned char)(n / 10 << 4 | n % 10);
}

/* Puts a size into the sorted buffer; false if it is full. */
_Bool store(int size)
{
    int i;

    if (n_buffer == N_BUFFER)
        return 0;
    i = n_buffer++;
    while (i > 0 && buffer[i - 1] > size) {
        buffer[i] = buffer[i - 1];
        i--;
    }
    buffer[i] = size;
    return 1;
}

/* Removes the smallest part of size `least` or more from the buffer; 0 if there is none. */
int fetch(int least)
{
    int i, size = 0;

    for (i = 0; i < n_buffer; i++)
        if (buffer[i] >= least)
            goto found;
    return size;
found:
    size = buffer[i];
    for (n_buffer--; i < n_buffer; i++)
        buffer[i] = buffer[i + 1];
    return size;
}

/* How long one pass wears the tool, by material and depth; a table and a root. */
int pass_wear(int material, int depth)
{
    int feed = feeds[material % 3][depth & 3];
    int load = hardness[tool] * depth;

    return clamp(load * 100 / feed + (int)root((unsigned)load), 1, 400);
}

/* Sorts the readings of a vibration sensor in place and gives their range. */
int spread(short readings[4])
{
    int i, j;
    short x;

    for (i = 1; i < 4; i++) {
        x = readings[i];
        for (j = i; j > 0; j--) {
            if (readings[j - 1] <= x)
                break;
            readings[j] = readings[j - 1];
        }
        readings[j] = x;
    }
    return readings[3] - readings[0];
}

/* Mills the blank in the vice; the number of passes goes to the caller. */
int mill(const unsigned char data[12], const unsigned char sensor[16], int *passes)
{
    short readings[4];
    int depth, rest, wanted, i, quiet = 0;

    *passes = 0;
    if (!loaded)
        return E_EMPTY;
    wanted = clamp(data[3], 1, loaded);
    rest = loaded - wanted;
    if (wear[tool] > WEAR_LIMIT)
        return E_WEAR;
    while (rest > 0) {
        /* the guard may open at any time */
        if (sensor[*passes & 15] & 0x40)
            return E_GUARD;
        depth = rest > 12 ? 12 : rest;
        if (++*passes > MAX_PASSES)
            break;

        /* vibration of this pass: four readings, each the middle of three */
        for (i = 0; i < 4; i++)
            readings[i] = median(sensor[i], sensor[(i + *passes) % 16], sensor[(i * 3 + 1) & 15]);
        if (spread(readings) > 140) {
            if (quiet++ >= 2)
                return E_VIBRATION;
            depth = depth > 2 ? depth / 2 : 1;
        } else if (quiet)
            --quiet;

        wear[tool] += pass_wear(data[4], depth);
        rest -= depth;
        if (wear[tool] <= WEAR_LIMIT)
            continue;
        loaded = wanted + rest;
        return E_WEAR;
    }
    loaded = wanted + rest;
    return OK;
}

/* Washes until the pressure is low three times in a row, or for twenty turns. */
int wash(const unsigned char sensor[16])
{
    int turn = 0, low = 0;

    do {
        if (sensor[turn & 15] < 32)
            low++;
        else
            low = 0;
        if (low == 3)
            return turn;
    } while (++turn < 20);
    return -1;
}

int cell(const unsigned char telegram[12], const unsigned char sensor[16], unsigned *status)
{
    int passes = 0, code = OK, n;
    unsigned char sequence;

    /* check the telegram */
    *status = 0;
    if (telegram[0] != SYNC)
        return E_SYNC;
    if (crc8(telegram, 11) != telegram[11])
        return E_CRC;
    sequence = telegram[10];
    if (sequence == last_sequence)
        return E_REPEAT;
    last_sequence = sequence;

    /* run it */
    switch (telegram[1]) {
    case OP_LOAD:
        if (loaded) {
            code = E_FULL;
            break;
        }
        loaded = clamp(telegram[2], 10, 120);
        /* a blank that came with its job is milled at once */
        if (telegram[3] == 0)
            break;
    case OP_MILL:
        code = mill(telegram, sensor, &passes);
        if (code)
            break;
    case OP_WASH:
        n = wash(sensor);
        if (n < 0) {
            code = E_PRESSURE;
            break;
        }
        passes += n;
        break;
    case OP_UNLOAD:
        if (!loaded)
            code = E_EMPTY;
        else if (!store(loaded))
            code = E_FULL;
        else {
            loaded = 0;
            parts_total++;
        }
        break;
    case OP_CHANGE:
        n = telegram[2];
        if (n >= N_TOOLS) {
            code = E_OPCODE;
            break;
        }
        if (telegram[3])
            wear[n] = 0;                        /* a new one */
        tool = n;
        break;
    case OP_REPORT:
        n = fetch(telegram[2]);
        if (n == 0)
            code = E_EMPTY;
        passes = n;
        break;
    case OP_STOP:
        for (n = 0; n < N_TOOLS; n++)
            wear[n] >>= 1;
        tool = 0;
        loaded = 0;
    case OP_NONE:
        ;
        break;
    default:
        code = E_OPCODE;
    }

    /* the word for the panel: passes, buffer, tool, total in decimal */
    *status = (unsigned)passes << 24 | (unsigned)n_buffer << 20 | (unsigned)tool << 16
            | (unsigned)bcd(parts_total) << 8 | (unsigned)(code & 0xff);
    return code;
}
