function y = @identifier@(u, start)
%@IDENTIFIER@  @title@
%   y = @identifier@(u) gives the output [@output_unit@] of the model for an input u
%   [@input_unit@] sampled every @sample_time@ s, started by the model's own rule.
%   y = @identifier@(u, 'steady') starts in equilibrium with the first input, and
%   y = @identifier@(u, 'empty') with an empty linear block.
%
%   @about@
%   Numbers are in @mat_file@, which must lie beside this file.

if nargin < 2
    start = 'fitted';
end
if ~any(strcmp(start, {'fitted', 'steady', 'empty'}))
    error('hwid:start', 'start must be ''fitted'', ''steady'' or ''empty''');
end
m = load(fullfile(fileparts(mfilename('fullpath')), '@mat_file@'));
u = u(:);

% w = f(u)
w = evaluate(m.input_map, u);

% x = B/F w. A start in equilibrium: only what differs from the first value moves.
is_fitted = strcmp(start, 'fitted');
if strcmp(start, 'steady') || (is_fitted && strcmp(m.initial_state, 'steady'))
    x = filter(m.B, m.F, w - w(1)) + w(1) * m.static_gain;
else
    x = filter(m.B, m.F, w);
end
if is_fitted && numel(m.C) > 0
    % The initial state answers like C/F to a pulse at the first sample.
    pulse = zeros(size(w));
    pulse(1) = 1;
    x = x + filter(m.C, m.F, pulse);
end

% y = g(x)
y = evaluate(m.output_map, x);
end


function v = evaluate(map, v)
% Value of a static map for a column v.
switch map.kind
    case 'none'
    case 'piecewise_linear'
        v = interp1(map.break_points(:), map.values(:), v, 'linear', 'extrap');
    case 'saturation'
        v = min(max(v, map.limits(1)), map.limits(2));
    case 'dead_zone'
        v = v - min(max(v, map.edges(1)), map.edges(2));
    case 'polynomial'
        v = chebyshev(map.chebyshev, (2 * v - sum(map.domain)) / diff(map.domain));
    case 'sigmoid_network'
        v = network(map, v, @(s) 0.5 * tanh(0.5 * s));
    case 'wavelet_network'
        v = network(map, v, @(s) (1 - s .^ 2) .* exp(-0.5 * s .^ 2));
    case 'cubic_spline'
        v = natural_spline(map, v);
    case 'piecewise_constant'
        place = ones(size(v));
        for edge = map.edges(:)'
            place = place + (v >= edge);
        end
        v = reshape(map.levels(place), size(v));
    otherwise
        error('hwid:map', 'unknown kind of map: %s', map.kind);
end
end


function v = chebyshev(c, s)
ahead = zeros(size(s));
beyond = ahead;
for i = numel(c):-1:2
    here = c(i) + 2 * s .* ahead - beyond;
    beyond = ahead;
    ahead = here;
end
v = c(1) + s .* ahead - beyond;
end


function y = network(map, v, unit)
y = map.line(1) + diff(map.line) / diff(map.domain) * (v - map.domain(1));
for i = 1:numel(map.centres)
    y = y + map.heights(i) * unit((v - map.centres(i)) / map.widths(i));
end
end


function y = natural_spline(map, v)
% Knots are equally spaced; bends are second derivatives for a spacing of one.
count = numel(map.values);
at = map.values(:);
bend = map.bends(:);
place = (v - map.ends(1)) * ((count - 1) / diff(map.ends));
left = min(max(floor(place), 0), count - 2);
share = place - left;
inside = min(max(share, 0), 1);
rest = 1 - inside;
left = left + 1;
slope = at(left + 1) - at(left) + (1 - 3 * rest .^ 2) / 6 .* bend(left) ...
    + (3 * inside .^ 2 - 1) / 6 .* bend(left + 1);
y = rest .* at(left) + inside .* at(left + 1) ...
    + (rest .^ 3 - rest) / 6 .* bend(left) ...
    + (inside .^ 3 - inside) / 6 .* bend(left + 1) + (share - inside) .* slope;
end
