// SPDX-License-Identifier: Apache-2.0
#include "roughing/network.h"
#include "base/rare.h"

#define INPUTS NETWORK_INPUTS
#define HIDDEN 6
#define ROWS (NETWORK_SAMPLES + 1)  /* the samples, then the question */
#define COLUMNS (INPUTS + 1)
#define ITERATIONS 40
#define TOLERANCE 1e-5f
#define WEIGHT 0.25f
#define BEND 0.40625f
#define JITTER 0.1f
#define FAINT 0.01f
#define LEAST 0x1p-12f
#define FIRST_DAMPING 0x1p-7f
#define LEAST_DAMPING 0x1p-20f
#define TURN 3.0f
#define LOWEST_SLOPE (-0.125f)

/* Start weights: one unit of each sign for every pair of inputs. */
static const struct {
    uint8_t one, other;
    float sign;
} PAIRS[HIDDEN] = {{0, 1, 1}, {0, 1, -1}, {0, 2, 1}, {0, 2, -1}, {1, 2, 1}, {1, 2, -1}};

/* Places of the weights: of each unit those of its inputs, then the bends, the units' parts of the
   output, and the linear part. */
#define W(k) ((k) * INPUTS)
#define B (HIDDEN * INPUTS)
#define C (B + HIDDEN)
#define A (C + HIDDEN)
#define A0 (A + INPUTS)
#define WEIGHTS (A0 + 1)

typedef struct {
    float weight[WEIGHTS];
    float hidden[ROWS][HIDDEN], slope[ROWS][HIDDEN];   /* for these weights */
    float error[ROWS];                                 /* of the question: the output */
} trial;

static trial trials[2];
static trial *kept, *tried;
static float x[ROWS][COLUMNS];     /* samples, then scaled; the question has no output */
static float middle[COLUMNS], half[COLUMNS], slopes[2], inverse;
static float matrix[NETWORK_SAMPLES][NETWORK_SAMPLES], v[NETWORK_SAMPLES];
static float steep[NETWORK_SAMPLES][HIDDEN];   /* c times slope; then times v */
static float along, across, damping, square;
static float low[INPUTS], high[INPUTS], near[HIDDEN], far[HIDDEN], total[INPUTS];
static int8_t wanted[INPUTS];
static uint32_t state;
static unsigned samples, iterations;
static bool converged, rises;

/* Add `count` products of two rows to a sum, or subtract them if `less`. The numbers of a row
   are `a_step` or `b_step` apart. Not inlined: float operations are calls, and most of them are
   here. */
static float __attribute__((noinline)) add(float sum, const float *a, unsigned a_step,
                                           const float *b, unsigned b_step, unsigned count,
                                           bool less) {
    for (; count; count--, a += a_step, b += b_step) {
        float product = *a * *b;
        sum = sum + (less ? -product : product);
    }
    return sum;
}

static float magnitude(float value) { return value < 0 ? -value : value; }

static float draw(void) {
    state = state * 1664525u + 1013904223u;
    return (float)((int32_t)(state >> 16) - 32768) * (1.0f / 32768);
}

/* Bounds of a column over the samples. */
static void bounds(unsigned column, float *lowest, float *highest) {
    *lowest = *highest = x[0][column];
    for (unsigned i = 1; i < samples; i++) {
        if (x[i][column] < *lowest)
            *lowest = x[i][column];
        if (x[i][column] > *highest)
            *highest = x[i][column];
    }
}

static void measure(unsigned column) {
    float lowest, highest;
    bounds(column, &lowest, &highest);
    middle[column] = (lowest + highest) * 0.5f;
    half[column] = (highest - lowest) * 0.5f;
    if (!(half[column] > 0))
        half[column] = 1;
}

static void scale(unsigned at) {
    float *row = x[at / COLUMNS];
    unsigned column = at % COLUMNS;
    row[column] = (row[column] - middle[column]) / half[column];
}

/* Subtract from the third input what one of the first two predicts of it, for each sample and then
   for the question. */
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
    float most = 0;
    for (unsigned i = 0; i < samples; i++)
        if (magnitude(x[i][2]) > most)
            most = magnitude(x[i][2]);
    inverse = most > LEAST ? 1.0f / most : 0;
}

static void stretch(unsigned at) { x[at][2] = x[at][2] * inverse; }

/* Two steps for each unit: its weights; its bend and its part of the output. */
static void start(unsigned at) {
    unsigned k = at / 2;
    if (at % 2) {
        tried->weight[B + k] = BEND + JITTER * draw() * BEND;
        tried->weight[C + k] = FAINT * draw();
        return;
    }
    float *w = &tried->weight[W(k)];
    for (unsigned j = 0; j < INPUTS; j++)
        w[j] = JITTER * draw() * WEIGHT;
    w[PAIRS[k].one] = w[PAIRS[k].one] + WEIGHT;
    w[PAIRS[k].other] = w[PAIRS[k].other] + PAIRS[k].sign * WEIGHT;
    if (at == 0) {
        for (unsigned p = A; p < WEIGHTS; p++)
            tried->weight[p] = 0;
        damping = FIRST_DAMPING;
        iterations = 0;
        square = -1;
    }
}

static void forward(unsigned at) {
    unsigned i = at / HIDDEN, k = at % HIDDEN;
    float z = add(tried->weight[B + k], x[i], 1, &tried->weight[W(k)], 1, INPUTS, false);
    float m = 1.0f / (1.0f + z * z);
    tried->hidden[i][k] = z * m;
    tried->slope[i][k] = (1.0f - z * z) * m * m;
}

static float output(const trial *of, unsigned i) {
    float y = add(of->weight[A0], x[i], 1, &of->weight[A], 1, INPUTS, false);
    return add(y, &of->weight[C], 1, of->hidden[i], 1, HIDDEN, false);
}

static void compare(unsigned i) { tried->error[i] = output(tried, i) - x[i][INPUTS]; }

/* Keep the weights of this trial if they are better. The first trial is always kept. */
static void judge(unsigned at) {
    (void)at;
    float sum = add(0, tried->error, 1, tried->error, 1, samples, false);
    bool first = square < 0;
    if (!first && !(sum < square)) {
        damping = damping * 8.0f;
        return;
    }
    trial *other = kept;
    kept = tried;
    tried = other;
    square = sum;
    if (!first) {
        damping = damping * 0.125f;
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
        steep[i][k] = kept->weight[C + k] * kept->slope[i][k];
}

/* Two steps for each element of the lower triangle. */
static void fill(unsigned at) {
    unsigned i = 0, j = at / 2;
    while (j > i)
        j -= ++i;
    if (at % 2) {
        float sum = add(matrix[i][j], kept->hidden[i], 1, kept->hidden[j], 1, HIDDEN, false);
        matrix[i][j] = i == j ? sum + damping : sum;
        return;
    }
    float kernel = add(1, x[i], 1, x[j], 1, INPUTS, false);
    matrix[i][j] = kernel * add(1, steep[i], 1, steep[j], 1, HIDDEN, false);
}

/* L below the diagonal, D on it, the transpose of L D above. */
static void factor(unsigned at) {
    unsigned j = 0, i = at;
    while (i >= samples - j)
        i -= samples - j++;
    i += j;
    float remainder = add(matrix[i][j], matrix[i], 1, &matrix[0][j], NETWORK_SAMPLES, j, true);
    matrix[j][i] = remainder;
    if (i != j)
        matrix[i][j] = remainder / matrix[j][j];
}

static void substitute(unsigned i) {
    v[i] = add(kept->error[i], matrix[i], 1, v, 1, i, true);
}

static void divide(unsigned i) { v[i] = v[i] / matrix[i][i]; }

static void substitute_back(unsigned at) {
    unsigned i = samples - 1 - at;
    if (at)
        v[i] = add(v[i], &matrix[i + 1][i], NETWORK_SAMPLES, &v[i + 1], 1, at, true);
}

static void back(unsigned i) {
    for (unsigned k = 0; k < HIDDEN; k++)
        steep[i][k] = v[i] * steep[i][k];
}

/* One weight in each step. */
static void update(unsigned p) {
    static const float one = 1;
    const float *a = v, *b = &one;
    unsigned a_step = 1, b_step = 0;
    if (p < C) {
        a = &steep[0][p < B ? p / INPUTS : p - B];
        a_step = HIDDEN;
    }
    if (p < B || (p >= A && p < A0)) {
        b = &x[0][p < B ? p % INPUTS : p - A];
        b_step = COLUMNS;
    } else if (p >= C && p < A) {
        b = &kept->hidden[0][p - C];
        b_step = HIDDEN;
    }
    tried->weight[p] = add(kept->weight[p], a, a_step, b, b_step, samples, true);
}

/* Evaluate the question, the row after the samples, with the weights that were kept. */
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
    /* An input that is the same in all samples is not used. */
    if (low[j] == high[j])
        wanted[j] = 0;
    if (x[samples][j] < low[j])
        low[j] = x[samples][j];
    if (x[samples][j] > high[j])
        high[j] = x[samples][j];
}

/* Convert weights of the third input as fit() has changed it into weights of the original one. */
static void unmix(const float *weights, float out[INPUTS]) {
    out[2] = weights[2] * inverse;
    for (unsigned j = 0; j < 2; j++)
        out[j] = weights[j] - slopes[j] * out[2];
}

static void begin_slopes(unsigned at) {
    (void)at;
    unmix(&kept->weight[A], total);
    for (unsigned j = 0; j < INPUTS; j++)
        total[j] = wanted[j] * total[j];
}

/* Find the smallest and the largest magnitude of a unit's argument within the box. */
static void reach(unsigned k) {
    float least = kept->weight[B + k], greatest = least;
    for (unsigned j = 0; j < INPUTS; j++) {
        float w = kept->weight[W(k) + j], one = w * low[j], other = w * high[j];
        least = least + (one < other ? one : other);
        greatest = greatest + (one < other ? other : one);
    }
    float one = magnitude(least), other = magnitude(greatest);
    near[k] = least <= 0 && greatest >= 0 ? 0 : one < other ? one : other;
    far[k] = one < other ? other : one;
}

static float slope_at(float z) {
    float m = 1.0f / (1.0f + z * z);
    return (1.0f - z * z) * m * m;
}

static void bound_slopes(unsigned k) {
    near[k] = near[k] * near[k] > TURN ? 0 : slope_at(near[k]);
    far[k] = far[k] * far[k] > TURN ? LOWEST_SLOPE : slope_at(far[k]);
}

static void add_slopes(unsigned k) {
    float weights[INPUTS];
    unmix(&kept->weight[W(k)], weights);
    for (unsigned j = 0; j < INPUTS; j++) {
        float part = wanted[j] * kept->weight[C + k] * weights[j];
        total[j] = total[j] + part * (part > 0 ? far[k] : near[k]);
    }
}

static void prove(unsigned at) {
    (void)at;
    rises = true;
    for (unsigned j = 0; j < INPUTS; j++)
        rises = rises && (!wanted[j] || total[j] > 0);
}

/* How often a stage runs: a number, or a multiple of the samples, of the rows (samples and
   question), or of the elements of the triangle. */
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
    {back, SAMPLE | 1}, {update, WEIGHTS},
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

void network_sample(float first, float second, float third, float out) {
    if (samples == NETWORK_SAMPLES)
        return;
    float *row = x[samples++];
    row[0] = first;
    row[1] = second;
    row[2] = third;
    row[INPUTS] = out;
}

void network_ask(float first, float second, float third, const int8_t signs[INPUTS]) {
    float *row = x[samples];
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

bool network_answer(float *out) {
    *out = kept->error[samples];
    return converged && rises;
}

unsigned network_iterations(void) { return iterations; }
