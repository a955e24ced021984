// SPDX-License-Identifier: Apache-2.0
#include "network.h"

#define INPUTS NETWORK_INPUTS
#define HIDDEN 6
#define ROWS (NETWORK_SAMPLES + 1)  /* the samples, and behind them the question */
#define COLUMNS (INPUTS + 1)
#define ITERATIONS 40
#define TOLERANCE 1e-7
#define WEIGHT 0.25
#define BEND 0.40625
#define JITTER 0.1
#define FAINT 0.01
#define LEAST 0x1p-20
#define FIRST_DAMPING 0x1p-7
#define LEAST_DAMPING 0x1p-30
#define TURN 3.0
#define LOWEST_SLOPE (-0.125)

/* Start weights: one unit of each sign for every pair of inputs. */
static const struct {
    uint8_t one, other;
    double sign;
} PAIRS[HIDDEN] = {{0, 1, 1}, {0, 1, -1}, {0, 2, 1}, {0, 2, -1}, {1, 2, 1}, {1, 2, -1}};

typedef struct {
    double w[HIDDEN][INPUTS], b[HIDDEN], c[HIDDEN], a[INPUTS], a0;
    double hidden[ROWS][HIDDEN], slope[ROWS][HIDDEN];   /* for these weights */
    double error[ROWS];                                 /* of the question: the output */
} trial;

static trial trials[2];
static trial *kept, *tried;
static double x[ROWS][COLUMNS];     /* samples, then scaled; the question has no output */
static double middle[COLUMNS], half[COLUMNS], slopes[2], inverse;
static double matrix[NETWORK_SAMPLES][NETWORK_SAMPLES], v[NETWORK_SAMPLES];
static double steep[NETWORK_SAMPLES][HIDDEN];   /* c times slope; then times v */
static double along, across, damping, square;
static double low[INPUTS], high[INPUTS], near[HIDDEN], far[HIDDEN], total[INPUTS];
static int8_t wanted[INPUTS];
static uint32_t state;
static unsigned samples, iterations;
static bool converged, rises;

static double magnitude(double value) { return value < 0 ? -value : value; }

static double draw(void) {
    state = state * 1664525u + 1013904223u;
    return (double)((int32_t)(state >> 16) - 32768) * (1.0 / 32768);
}

/* Bounds of a column over the samples. */
static void bounds(unsigned column, double *lowest, double *highest) {
    *lowest = *highest = x[0][column];
    for (unsigned i = 1; i < samples; i++) {
        if (x[i][column] < *lowest)
            *lowest = x[i][column];
        if (x[i][column] > *highest)
            *highest = x[i][column];
    }
}

static void measure(unsigned column) {
    double lowest, highest;
    bounds(column, &lowest, &highest);
    middle[column] = (lowest + highest) * 0.5;
    half[column] = (highest - lowest) * 0.5;
    if (!(half[column] > 0))
        half[column] = 1;
}

static void scale(unsigned at) {
    double *row = x[at / COLUMNS];
    unsigned column = at % COLUMNS;
    row[column] = (row[column] - middle[column]) / half[column];
}

/* The third input less what one of the first two says of it, sample by sample, the question last. */
static void fit(unsigned at, unsigned j) {
    if (at == 0)
        along = across = 0;
    along = along + x[at][2] * x[at][j];
    across = across + x[at][j] * x[at][j];
    if (at == samples - 1)
        slopes[j] = across > 0 ? along / across : 0;
}

static void fit_first(unsigned at) { fit(at, 0); }
static void fit_second(unsigned at) { fit(at, 1); }
static void free_of(unsigned at, unsigned j) { x[at][2] = x[at][2] - slopes[j] * x[at][j]; }
static void free_of_first(unsigned at) { free_of(at, 0); }
static void free_of_second(unsigned at) { free_of(at, 1); }

static void widest(unsigned at) {
    (void)at;
    double most = 0;
    for (unsigned i = 0; i < samples; i++)
        if (magnitude(x[i][2]) > most)
            most = magnitude(x[i][2]);
    inverse = most > LEAST ? 1.0 / most : 0;
}

static void stretch(unsigned at) { x[at][2] = x[at][2] * inverse; }

/* Two steps a unit: its weights; its bend and its part of the output. */
static void start(unsigned at) {
    unsigned k = at / 2;
    if (at % 2) {
        tried->b[k] = BEND + JITTER * draw() * BEND;
        tried->c[k] = FAINT * draw();
        return;
    }
    double *w = tried->w[k];
    for (unsigned j = 0; j < INPUTS; j++)
        w[j] = JITTER * draw() * WEIGHT;
    w[PAIRS[k].one] = w[PAIRS[k].one] + WEIGHT;
    w[PAIRS[k].other] = w[PAIRS[k].other] + PAIRS[k].sign * WEIGHT;
    if (at == 0) {
        for (unsigned j = 0; j < INPUTS; j++)
            tried->a[j] = 0;
        tried->a0 = 0;
        damping = FIRST_DAMPING;
        iterations = 0;
        square = -1;
    }
}

static void forward(unsigned at) {
    unsigned i = at / HIDDEN, k = at % HIDDEN;
    double z = tried->b[k];
    for (unsigned j = 0; j < INPUTS; j++)
        z = z + x[i][j] * tried->w[k][j];
    double m = 1.0 / (1.0 + z * z);
    tried->hidden[i][k] = z * m;
    tried->slope[i][k] = (1.0 - z * z) * m * m;
}

static double output(const trial *of, unsigned i) {
    double y = of->a0 + x[i][0] * of->a[0];
    for (unsigned j = 1; j < INPUTS; j++)
        y = y + x[i][j] * of->a[j];
    for (unsigned k = 0; k < HIDDEN; k++)
        y = y + of->c[k] * of->hidden[i][k];
    return y;
}

static void compare(unsigned i) { tried->error[i] = output(tried, i) - x[i][INPUTS]; }

/* Keep what was tried if it is better; the first is kept anyway. */
static void judge(unsigned at) {
    (void)at;
    double sum = 0;
    for (unsigned i = 0; i < samples; i++)
        sum = sum + tried->error[i] * tried->error[i];
    bool first = square < 0;
    if (!first && !(sum < square)) {
        damping = damping * 8.0;
        return;
    }
    trial *other = kept;
    kept = tried;
    tried = other;
    square = sum;
    if (!first) {
        damping = damping * 0.125;
        if (damping < LEAST_DAMPING)
            damping = LEAST_DAMPING;
    }
}

static void test(unsigned at) {
    (void)at;
    converged = true;
    for (unsigned i = 0; i < samples; i++)
        if (magnitude(kept->error[i]) > TOLERANCE)
            converged = false;
    iterations += !converged && iterations < ITERATIONS;
}

static void steepen(unsigned i) {
    for (unsigned k = 0; k < HIDDEN; k++)
        steep[i][k] = kept->c[k] * kept->slope[i][k];
}

/* Two steps an element of the lower triangle. */
static void fill(unsigned at) {
    unsigned i = 0, j = at / 2;
    while (j > i)
        j -= ++i;
    if (at % 2) {
        double sum = matrix[i][j];
        for (unsigned k = 0; k < HIDDEN; k++)
            sum = sum + kept->hidden[i][k] * kept->hidden[j][k];
        matrix[i][j] = i == j ? sum + damping : sum;
        return;
    }
    double kernel = 1, sum = 1;
    for (unsigned k = 0; k < INPUTS; k++)
        kernel = kernel + x[i][k] * x[j][k];
    for (unsigned k = 0; k < HIDDEN; k++)
        sum = sum + steep[i][k] * steep[j][k];
    matrix[i][j] = kernel * sum;
}

/* L below the diagonal, D on it, the transpose of L D above. */
static void factor(unsigned at) {
    unsigned j = 0, i = at;
    while (i >= samples - j)
        i -= samples - j++;
    i += j;
    double rest = matrix[i][j];
    for (unsigned k = 0; k < j; k++)
        rest = rest - matrix[i][k] * matrix[k][j];
    matrix[j][i] = rest;
    if (i != j)
        matrix[i][j] = rest / matrix[j][j];
}

static void substitute(unsigned i) {
    v[i] = kept->error[i];
    for (unsigned k = 0; k < i; k++)
        v[i] = v[i] - matrix[i][k] * v[k];
}

static void divide(unsigned i) { v[i] = v[i] / matrix[i][i]; }

static void substitute_back(unsigned at) {
    unsigned i = samples - 1 - at;
    for (unsigned k = i + 1; k < samples; k++)
        v[i] = v[i] - matrix[k][i] * v[k];
}

static void back(unsigned i) {
    for (unsigned k = 0; k < HIDDEN; k++)
        steep[i][k] = v[i] * steep[i][k];
}

/* A weight a step: of each unit those of its inputs, its bend, its part; then the linear ones. */
static void update(unsigned at) {
    unsigned k = at / (INPUTS + 2), j = at % (INPUTS + 2);
    const double *old = k == HIDDEN ? j < INPUTS ? &kept->a[j] : &kept->a0
                        : j < INPUTS ? &kept->w[k][j] : j == INPUTS ? &kept->b[k] : &kept->c[k];
    double sum = *old;
    for (unsigned i = 0; i < samples; i++) {
        if (k == HIDDEN)
            sum = sum - (j < INPUTS ? v[i] * x[i][j] : v[i]);
        else if (j < INPUTS)
            sum = sum - steep[i][k] * x[i][j];
        else
            sum = sum - (j == INPUTS ? steep[i][k] : v[i] * kept->hidden[i][k]);
    }
    double *new = k == HIDDEN ? j < INPUTS ? &tried->a[j] : &tried->a0
                  : j < INPUTS ? &tried->w[k][j] : j == INPUTS ? &tried->b[k] : &tried->c[k];
    *new = sum;
}

/* The question is a row behind the samples, for the weights that are kept. */
static void ask(unsigned k) {
    trial *other = tried;
    tried = kept;
    forward(samples * HIDDEN + k);
    tried = other;
}

static void answer(unsigned at) {
    (void)at;
    kept->error[samples] = output(kept, samples) * half[INPUTS] + middle[INPUTS];
}

static void widen(unsigned j) {
    bounds(j, &low[j], &high[j]);
    /* An input that all samples have the same is not asked. */
    if (low[j] == high[j])
        wanted[j] = 0;
    if (x[samples][j] < low[j])
        low[j] = x[samples][j];
    if (x[samples][j] > high[j])
        high[j] = x[samples][j];
}

/* From weights of the third input as it was freed to weights of it as it came. */
static void unmix(const double *weights, double out[INPUTS]) {
    out[2] = weights[2] * inverse;
    for (unsigned j = 0; j < 2; j++)
        out[j] = weights[j] - slopes[j] * out[2];
}

static void begin_slopes(unsigned at) {
    (void)at;
    unmix(kept->a, total);
    for (unsigned j = 0; j < INPUTS; j++)
        total[j] = wanted[j] * total[j];
}

/* How near to 0 and how far from it a unit's argument can be over the box. */
static void reach(unsigned k) {
    double least = kept->b[k], greatest = kept->b[k];
    for (unsigned j = 0; j < INPUTS; j++) {
        double one = kept->w[k][j] * low[j], other = kept->w[k][j] * high[j];
        least = least + (one < other ? one : other);
        greatest = greatest + (one < other ? other : one);
    }
    double one = magnitude(least), other = magnitude(greatest);
    near[k] = least <= 0 && greatest >= 0 ? 0 : one < other ? one : other;
    far[k] = one < other ? other : one;
}

static double slope_at(double z) {
    double m = 1.0 / (1.0 + z * z);
    return (1.0 - z * z) * m * m;
}

static void bound_slopes(unsigned k) {
    near[k] = near[k] * near[k] > TURN ? 0 : slope_at(near[k]);
    far[k] = far[k] * far[k] > TURN ? LOWEST_SLOPE : slope_at(far[k]);
}

static void add_slopes(unsigned k) {
    double weights[INPUTS];
    unmix(kept->w[k], weights);
    for (unsigned j = 0; j < INPUTS; j++) {
        double part = wanted[j] * kept->c[k] * weights[j];
        total[j] = total[j] + part * (part > 0 ? far[k] : near[k]);
    }
}

static void prove(unsigned at) {
    (void)at;
    rises = true;
    for (unsigned j = 0; j < INPUTS; j++)
        rises = rises && (!wanted[j] || total[j] > 0);
}

/* How often a stage runs: so many times the rows (ROW: the question too), or a number. */
enum { ONCE = 1, SAMPLE = 0x100, ROW = 0x200, TRIANGLE = 0x400 };

static const struct {
    void (*run)(unsigned at);
    uint16_t times;
} STAGES[] = {
    {measure, COLUMNS},
    {scale, ROW | COLUMNS},
    {fit_first, SAMPLE | 1}, {free_of_first, ROW | 1},
    {fit_second, SAMPLE | 1}, {free_of_second, ROW | 1},
    {widest, ONCE}, {stretch, ROW | 1},
    {start, HIDDEN * 2},
#define LEARN 9
    {forward, SAMPLE | HIDDEN}, {compare, SAMPLE | 1}, {judge, ONCE}, {test, ONCE},
#define LEARNED 13
    {steepen, SAMPLE | 1}, {fill, TRIANGLE | 2}, {factor, TRIANGLE | 1},
    {substitute, SAMPLE | 1}, {divide, SAMPLE | 1}, {substitute_back, SAMPLE | 1},
    {back, SAMPLE | 1}, {update, (HIDDEN + 1) * (INPUTS + 2) - 1},
#define INFER 21
    {ask, HIDDEN}, {answer, ONCE}, {widen, INPUTS}, {begin_slopes, ONCE},
    {reach, HIDDEN}, {bound_slopes, HIDDEN}, {add_slopes, HIDDEN}, {prove, ONCE},
};
#define STAGE_COUNT (sizeof STAGES / sizeof *STAGES)

static unsigned stage, turn;

void network_begin(uint32_t seed) {
    state = seed;
    samples = stage = turn = 0;
    kept = &trials[0];
    tried = &trials[1];
    converged = rises = false;
}

void network_sample(double first, double second, double third, double out) {
    if (samples == NETWORK_SAMPLES)
        return;
    double *row = x[samples++];
    row[0] = first;
    row[1] = second;
    row[2] = third;
    row[INPUTS] = out;
}

void network_ask(double first, double second, double third, const int8_t signs[INPUTS]) {
    double *row = x[samples];
    row[0] = first;
    row[1] = second;
    row[2] = third;
    row[INPUTS] = 0;
    for (unsigned j = 0; j < INPUTS; j++)
        wanted[j] = signs[j];
}

static unsigned times(unsigned of) {
    unsigned each = STAGES[of].times & 0xff;
    if (STAGES[of].times & SAMPLE)
        return each * samples;
    if (STAGES[of].times & ROW)
        return each * (samples + 1);
    if (STAGES[of].times & TRIANGLE)
        return each * samples * (samples + 1) / 2;
    return each;
}

bool network_step(void) {
    if (stage == STAGE_COUNT)
        return false;
    unsigned before = iterations;
    STAGES[stage].run(turn++);
    if (turn < times(stage))
        return true;
    turn = 0;
    stage++;
    if (stage == LEARNED && iterations == before)
        stage = INFER; /* the last test wanted no further iteration */
    else if (stage == INFER)
        stage = LEARN;
    return stage < STAGE_COUNT;
}

bool network_answer(double *out) {
    *out = kept->error[samples];
    return converged && rises;
}

unsigned network_iterations(void) { return iterations; }
