"""A picture of time against rows, one line a solver, both axes logarithmic; SVG written directly, no package needed."""
import math

WIDTH, HEIGHT = 780, 520
LEFT, RIGHT, TOP, BOTTOM = 74, 205, 62, 58
OURS = "#c0392b"
COLORS = ["#1f618d", "#117a65", "#7d3c98", "#b7950b", "#34495e", "#2e86c1", "#a04000", "#229954", "#85929e", "#6c3483"]
TEXT = 'font-family="Helvetica, Arial, sans-serif"'


def _seconds(value):
    return f"{value:g} s" if value >= 1 else f"{value * 1e3:g} ms" if value >= 1e-3 else f"{value * 1e6:g} µs"


def _spread(wanted, gap):
    """Heights for labels, ascending, at least gap apart, as near as may be to what is wanted."""
    placed = []
    for y in wanted:
        placed.append([y, y, 1])  # a block of labels: sum of wanted tops, top, how many
        while len(placed) > 1 and placed[-2][1] + placed[-2][2] * gap > placed[-1][1]:
            below, above = placed.pop(), placed.pop()
            total = above[0] + below[0] - below[2] * above[2] * gap
            placed.append([total, total / (above[2] + below[2]), above[2] + below[2]])
    return [top + k * gap for _, top, count in placed for k in range(count)]


def write(path, rows):
    """rows: dicts with solver, m, seconds, solved, note. What is not solved is drawn hollow; what was ended says so."""
    lines, ended = {}, {r["solver"] for r in rows if r["m"] == max(q["m"] for q in rows) and r["note"] == "time"}
    for r in rows:
        lines.setdefault(r["solver"], []).append((r["m"], r["seconds"], r["solved"]))
    if not lines:
        return
    sizes = sorted({m for line in lines.values() for m, _, _ in line})
    times = [s for line in lines.values() for _, s, _ in line]
    x_low, x_high = math.log10(sizes[0]) - 0.06, math.log10(sizes[-1]) + 0.06
    y_low, y_high = math.floor(math.log10(min(times)) * 2) / 2, math.ceil(math.log10(max(times)) * 2) / 2

    def x(m):
        return LEFT + (math.log10(m) - x_low) / (x_high - x_low) * (WIDTH - LEFT - RIGHT)

    def y(s):
        return HEIGHT - BOTTOM - (math.log10(s) - y_low) / (y_high - y_low) * (HEIGHT - TOP - BOTTOM)

    out = [f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{HEIGHT}" viewBox="0 0 {WIDTH} {HEIGHT}">',
           f'<rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>',
           f'<text x="{LEFT}" y="26" {TEXT} font-size="16" fill="#222">Convex surface patches: 48 unknowns, time against '
           f'rows</text>',
           f'<text x="{LEFT}" y="45" {TEXT} font-size="12" fill="#666">one thread, cold solve, residuals and gap to 1e-9; '
           f'hollow: misses that, or was ended</text>']
    for power in range(math.ceil(y_low), math.floor(y_high) + 1):
        at = y(10.0 ** power)
        out.append(f'<line x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{at:.1f}" y2="{at:.1f}" stroke="#ddd"/>')
        out.append(f'<text x="{LEFT - 8}" y="{at + 4:.1f}" {TEXT} font-size="12" fill="#444" text-anchor="end">'
                   f'{_seconds(10.0 ** power)}</text>')
    for m in sizes:
        out.append(f'<line x1="{x(m):.1f}" x2="{x(m):.1f}" y1="{TOP}" y2="{HEIGHT - BOTTOM}" stroke="#eee"/>')
        out.append(f'<text x="{x(m):.1f}" y="{HEIGHT - BOTTOM + 20}" {TEXT} font-size="12" fill="#444" '
                   f'text-anchor="middle">{m:,}</text>')
    out.append(f'<text x="{(LEFT + WIDTH - RIGHT) / 2:.0f}" y="{HEIGHT - 14}" {TEXT} font-size="12" fill="#444" '
               f'text-anchor="middle">rows</text>')
    order = sorted(lines, key=lambda label: y(max(lines[label])[1]))
    heights = _spread([y(max(lines[label])[1]) for label in order], 16)
    theirs = iter(COLORS * 3)
    for label, height in zip(order, heights):
        line, ours = sorted(lines[label]), label.startswith("batten")
        color, width = (OURS, 3) if ours else (next(theirs), 1.6)
        dash = ' stroke-dasharray="6 4"' if ours and label != "batten" else ""
        points = " ".join(f"{x(m):.1f},{y(s):.1f}" for m, s, _ in line)
        out.append(f'<polyline points="{points}" fill="none" stroke="{color}" stroke-width="{width}"{dash}/>')
        for m, s, solved in line:
            out.append(f'<circle cx="{x(m):.1f}" cy="{y(s):.1f}" r="{4 if ours else 3}" stroke="{color}" '
                       f'fill="{color if solved else "white"}"/>')
        end = line[-1]
        out.append(f'<line x1="{x(end[0]) + 5:.1f}" y1="{y(end[1]):.1f}" x2="{WIDTH - RIGHT + 22}" y2="{height:.1f}" '
                   f'stroke="{color}" stroke-width="0.6"/>')
        weight = ' font-weight="bold"' if ours else ""
        time = ("over " if label in ended else "") + _time(end[1])
        out.append(f'<text x="{WIDTH - RIGHT + 26}" y="{height + 4:.1f}" {TEXT} font-size="12.5" fill="{color}"{weight}>'
                   f'{label} · {time}</text>')
    out.append("</svg>")
    with open(path, "w", encoding="utf-8") as f:
        f.write("\n".join(out) + "\n")


def _time(seconds):
    return f"{seconds:.3g} s" if seconds >= 1 else f"{seconds * 1e3:.3g} ms"
