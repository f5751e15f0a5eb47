/* Natural cubic spline through equally spaced knots; straight beyond its ends. */
static const double @side@_ends[2] = {@ends@};
static const double @side@_values[@count@] = {@values@};
static const double @side@_bends[@count@] = {@bends@};

static double @side@_map(double v)
{
    const double first = @side@_ends[0], last = @side@_ends[1];
    const double place = (v - first) * (@count_less_one@.0 / (last - first));
    const int left = place < 0.0 ? 0
        : place >= @count_less_one@.0 ? @count@ - 2 : (int)floor(place);
    const double share = place - left;
    const double inside = fmin(fmax(share, 0.0), 1.0);
    const double rest = 1.0 - inside;
    const double bend = @side@_bends[left], next = @side@_bends[left + 1];
    double slope = @side@_values[left + 1] - @side@_values[left], value;
    slope += (1.0 - 3.0 * rest * rest) / 6.0 * bend;
    slope += (3.0 * inside * inside - 1.0) / 6.0 * next;
    value = rest * @side@_values[left] + inside * @side@_values[left + 1];
    value += (rest * rest * rest - rest) / 6.0 * bend;
    value += (inside * inside * inside - inside) / 6.0 * next;
    return value + (share - inside) * slope;
}
