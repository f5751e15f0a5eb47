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
if ~isfield(map, 'extrapolation')
    v = law(map, v);
    return
end
% The law holds where the data of the fit were, straight lines elsewhere.
at = v;
lines = map.extrapolation;
v = interp1(lines.arguments(:), lines.values(:), at, 'linear', 'extrap');
inside = false(size(at));
for i = 1:2:numel(lines.visited)
    inside = inside | (at >= lines.visited(i) & at <= lines.visited(i + 1));
end
v(inside) = law(map, at(inside));
end


function v = law(map, v)
% Value of a static map by the law of its kind.
switch map.kind
@cases@
    otherwise
        error('hwid:map', 'unknown kind of map: %s', map.kind);
end
end


@functions@
