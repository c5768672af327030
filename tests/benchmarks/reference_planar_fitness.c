/* Fitness of strings of via-points of two planar arms of two links (Rana & Zalzala 1995, Eqs. 2-7),
 * as careful C: individuals innermost in blocks that stay in the first-level cache, angles summed
 * instead of rotations multiplied, sines and cosines by the vector functions of glibc's libmvec
 * (4 units in the last place), contraction to fused operations as the compiler likes.
 *
 * Compiled with -DPOINTS -DCIRCLES -DBLOCK, so that all inner bounds are constants.
 */

#include <math.h>

#ifndef POINTS
#define POINTS 16 /* via-points behind the start: instants that may collide */
#endif
#ifndef CIRCLES
#define CIRCLES 9 /* of an arm */
#endif
#ifndef BLOCK
#define BLOCK 104 /* individuals that are judged together */
#endif

#define ARMS 2
#define JOINTS 2
#define DEGREE 0.017453292519943295

#if defined(__AVX512F__)
#define WIDTH 8
typedef double vector __attribute__((vector_size(64), aligned(8)));
extern vector _ZGVeN8v_sin(vector), _ZGVeN8v_cos(vector);
#define SIN _ZGVeN8v_sin
#define COS _ZGVeN8v_cos
#elif defined(__AVX2__)
#define WIDTH 4
typedef double vector __attribute__((vector_size(32), aligned(8)));
extern vector _ZGVdN4v_sin(vector), _ZGVdN4v_cos(vector);
#define SIN _ZGVdN4v_sin
#define COS _ZGVdN4v_cos
#else
#define WIDTH 2
typedef double vector __attribute__((vector_size(16), aligned(8)));
extern vector _ZGVbN2v_sin(vector), _ZGVbN2v_cos(vector);
#define SIN _ZGVbN2v_sin
#define COS _ZGVbN2v_cos
#endif

struct arms {
    double base[ARMS][2];
    long link[CIRCLES];       /* the link that each circle of an arm stands on */
    double along[ARMS][CIRCLES]; /* from the beginning of its link */
    double length[ARMS];      /* of the first link */
    double radius;
    double weights[3];        /* of lengths, unevenness, colliding instants */
};

static void place_circles(const struct arms *arms, const double *angles, long row, int arm,
                          double x[CIRCLES][BLOCK], double y[CIRCLES][BLOCK])
{
    double angle[JOINTS][BLOCK], sine[JOINTS][BLOCK], cosine[JOINTS][BLOCK];
    for (int n = 0; n < BLOCK; n++) {
        angle[0][n] = angles[n] * DEGREE;
        angle[1][n] = (angles[n] + angles[row + n]) * DEGREE;
    }
    for (int j = 0; j < JOINTS; j++)
        for (int n = 0; n < BLOCK; n += WIDTH) {
            vector a = *(const vector *)&angle[j][n];
            *(vector *)&sine[j][n] = SIN(a);
            *(vector *)&cosine[j][n] = COS(a);
        }
    for (int c = 0; c < CIRCLES; c++) {
        double along = arms->along[arm][c], first = arms->link[c] ? arms->length[arm] : along;
        double second = arms->link[c] ? along : 0.0;
        for (int n = 0; n < BLOCK; n++) {
            x[c][n] = arms->base[arm][0] + first * cosine[0][n] + second * cosine[1][n];
            y[c][n] = arms->base[arm][1] + first * sine[0][n] + second * sine[1][n];
        }
    }
}

static void count_hits(const struct arms *arms, const double *strings, long individuals, long first,
                       double hits[BLOCK])
{
    double x[ARMS][CIRCLES][BLOCK], y[ARMS][CIRCLES][BLOCK], least[BLOCK];
    double limit = 4.0 * arms->radius * arms->radius;
    long row = (POINTS + 1) * individuals; /* from one joint to the next */
    for (int n = 0; n < BLOCK; n++)
        hits[n] = 0.0;
    for (int i = 1; i <= POINTS; i++) {
        for (int arm = 0; arm < ARMS; arm++)
            place_circles(arms, strings + arm * JOINTS * row + i * individuals + first, row, arm,
                          x[arm], y[arm]);
        for (int n = 0; n < BLOCK; n++)
            least[n] = INFINITY;
        for (int a = 0; a < CIRCLES; a++)
            for (int b = 0; b < CIRCLES; b++)
                for (int n = 0; n < BLOCK; n++) {
                    double u = x[0][a][n] - x[1][b][n], v = y[0][a][n] - y[1][b][n];
                    double square = u * u + v * v;
                    least[n] = square < least[n] ? square : least[n];
                }
        for (int n = 0; n < BLOCK; n++)
            hits[n] += least[n] < limit ? 1.0 : 0.0;
    }
}

/* strings: (ARMS * JOINTS, POINTS + 1, individuals) [deg], individuals a multiple of BLOCK. */
void planar_fitness(const struct arms *arms, const double *strings, long individuals, double *cost)
{
    long row = (POINTS + 1) * individuals;
    for (long first = 0; first < individuals; first += BLOCK) {
        double hits[BLOCK], sum[BLOCK] = {0.0}, uneven[BLOCK] = {0.0};
        count_hits(arms, strings, individuals, first, hits);
        for (int arm = 0; arm < ARMS; arm++) {
            double step[POINTS][BLOCK], length[BLOCK] = {0.0};
            const double *q = strings + arm * JOINTS * row + first;
            for (int i = 0; i < POINTS; i++)
                for (int n = 0; n < BLOCK; n++) {
                    const double *one = q + i * individuals + n, *two = one + individuals;
                    double u = two[0] - one[0], v = two[row] - one[row];
                    step[i][n] = sqrt(u * u + v * v);
                    length[n] += step[i][n];
                }
            for (int i = 0; i < POINTS; i++)
                for (int n = 0; n < BLOCK; n++)
                    uneven[n] += fabs(step[i][n] - length[n] / POINTS);
            for (int n = 0; n < BLOCK; n++)
                sum[n] += length[n];
        }
        for (int n = 0; n < BLOCK; n++)
            cost[first + n] = arms->weights[0] * sum[n] + arms->weights[1] * uneven[n]
                              + arms->weights[2] * hits[n];
    }
}
