/* FASTSIM on strips as one would write it in C: the yardstick of test_contact_speed.py.
 *
 * Same input, output and arithmetic as the kernel of wearsim.contact.tangential.fastsim: tractions at the cell
 * ends, means of pressure, traction and slip in the cells. Arrays are (m, ny) or (5, m, nx, ny). */
#include <math.h>

/* Strip by strip, each from its leading to its trailing end. */
void by_strip(int patches, int cells, int strips, const double *y, const double *width, const double *lead,
              const double *trail, const double *friction, const double *slope, const double *creepage,
              const double *flexibility, const double *mean, double *out, double *force, double *slip_area)
{
    const long field = (long)patches * cells * strips;
    for (int m = 0; m < patches; m++) {
        const double rate_x = creepage[3 * m] / flexibility[m];
        const double rate_y = creepage[3 * m + 1] / flexibility[patches + m];
        const double rate_s = creepage[3 * m + 2] / flexibility[2 * patches + m];
        double f_x = 0, f_y = 0, moment = 0, slip = 0;
        for (int j = 0; j < strips; j++) {
            const double half = 0.5 * (lead[m * strips + j] - trail[m * strips + j]);
            const double middle = 0.5 * (lead[m * strips + j] + trail[m * strips + j]);
            const double lateral = y[m * strips + j], dx = 2.0 * half / cells;
            const double flex = half > 0 ? mean[m] / dx : 0, largest = half * slope[m * strips + j];
            double t_x = 0, t_y = 0, p_up = 0;
            for (int i = 0; i < cells; i++) {
                const double x = middle + (1.0 - (2.0 * i + 1.0) / cells) * half;
                const double behind = 1.0 - 2.0 * (i + 1) / cells;
                const double p_here = i < cells - 1 ? largest * sqrt(1.0 - behind * behind) : 0.0;
                const double trial_x = t_x - (rate_x - rate_s * lateral) * dx;
                const double trial_y = t_y - (rate_y + rate_s * x) * dx;
                const double limit = friction[m] * p_here, size = sqrt(trial_x * trial_x + trial_y * trial_y);
                const double share = size > limit ? limit / size : 1.0;
                const double new_x = trial_x * share, new_y = trial_y * share;
                const double mean_x = 0.5 * (t_x + new_x), mean_y = 0.5 * (t_y + new_y);
                const double excess = (share - 1.0) * flex;
                double *cell = out + ((long)m * cells + i) * strips + j;
                cell[0] = 0.5 * (p_up + p_here);
                cell[field] = mean_x;
                cell[2 * field] = mean_y;
                cell[3 * field] = trial_x * excess;
                cell[4 * field] = trial_y * excess;
                f_x += mean_x * dx;
                f_y += mean_y * dx;
                moment += (x * mean_y - lateral * mean_x) * dx;
                slip += size > limit ? dx : 0.0;
                t_x = new_x;
                t_y = new_y;
                p_up = p_here;
            }
        }
        force[3 * m] = f_x * width[m];
        force[3 * m + 1] = f_y * width[m];
        force[3 * m + 2] = moment * width[m];
        slip_area[m] = slip * width[m];
    }
}

/* The same march with the strips in the inner loop, so that a compiler can use vector instructions. */
void across_strips(int patches, int cells, int strips, const double *restrict y, const double *restrict width,
                   const double *restrict lead, const double *restrict trail, const double *restrict friction,
                   const double *restrict slope, const double *restrict creepage,
                   const double *restrict flexibility, const double *restrict mean, double *restrict out,
                   double *restrict force, double *restrict slip_area)
{
    const long field = (long)patches * cells * strips;
    double half[512], middle[512], flex[512], t_x[512], t_y[512], largest[512];
    double length[512], step_x[512], step_y[512], step_s[512];
    for (int m = 0; m < patches; m++) {
        const double rate_x = creepage[3 * m] / flexibility[m];
        const double rate_y = creepage[3 * m + 1] / flexibility[patches + m];
        const double rate_s = creepage[3 * m + 2] / flexibility[2 * patches + m];
        double f_x = 0, f_y = 0, moment = 0, slip = 0;
        const double *restrict place_y = y + m * strips;
        for (int j = 0; j < strips; j++) {
            half[j] = 0.5 * (lead[m * strips + j] - trail[m * strips + j]);
            middle[j] = 0.5 * (lead[m * strips + j] + trail[m * strips + j]);
            flex[j] = half[j] > 0 ? 0.5 * cells * mean[m] / half[j] : 0;
            largest[j] = half[j] * slope[m * strips + j];
            length[j] = half[j] * (2.0 / cells);
            step_x[j] = (rate_x - rate_s * place_y[j]) * length[j];
            step_y[j] = (rate_y + rate_s * middle[j]) * length[j];
            step_s[j] = rate_s * half[j] * length[j];
            t_x[j] = t_y[j] = 0;
        }
        double root_before = 0;
        for (int i = 0; i < cells; i++) {
            const double place = 1.0 - (2.0 * i + 1.0) / cells, behind = 1.0 - 2.0 * (i + 1) / cells;
            const double root = i < cells - 1 ? sqrt(1.0 - behind * behind) : 0.0;
            const double bound = friction[m] * root, mean_root = 0.5 * (root_before + root);
            root_before = root;
            double *restrict cell = out + ((long)m * cells + i) * strips;
            double *restrict cell_x = cell + field, *restrict cell_y = cell + 2 * field;
            double *restrict slip_x = cell + 3 * field, *restrict slip_y = cell + 4 * field;
            for (int j = 0; j < strips; j++) {
                const double dx = length[j], x = middle[j] + place * half[j];
                const double trial_x = t_x[j] - step_x[j], trial_y = t_y[j] - (step_y[j] + place * step_s[j]);
                const double limit = bound * largest[j];
                const double size = sqrt(trial_x * trial_x + trial_y * trial_y);
                const double share = size > limit ? limit / size : 1.0;
                const double new_x = trial_x * share, new_y = trial_y * share;
                const double mean_x = 0.5 * (t_x[j] + new_x), mean_y = 0.5 * (t_y[j] + new_y);
                const double excess = (share - 1.0) * flex[j];
                cell[j] = mean_root * largest[j];
                cell_x[j] = mean_x;
                cell_y[j] = mean_y;
                slip_x[j] = trial_x * excess;
                slip_y[j] = trial_y * excess;
                const double part_x = mean_x * dx, part_y = mean_y * dx;
                f_x += part_x;
                f_y += part_y;
                moment += x * part_y - place_y[j] * part_x;
                slip += size > limit ? dx : 0.0;
                t_x[j] = new_x;
                t_y[j] = new_y;
            }
        }
        force[3 * m] = f_x * width[m];
        force[3 * m + 1] = f_y * width[m];
        force[3 * m + 2] = moment * width[m];
        slip_area[m] = slip * width[m];
    }
}
