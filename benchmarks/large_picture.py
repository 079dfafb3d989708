"""A picture of the time of a fit against its points, both axes logarithmic, with slopes; SVG written directly, no package
needed. Usage: large_picture.py PICTURE.svg FIGURES.json [PEERS.json]
  FIGURES.json  of bench-large --accuracy 1e-6 --dense 16000 --json FIGURES.json N ...
  PEERS.json    of large_peers.py --json: SciPy's times on the same machine, if wanted"""
import json
import math
import sys

WIDTH, HEIGHT = 820, 540
LEFT, RIGHT, TOP, BOTTOM = 74, 215, 66, 58
FAST, DENSE, THEIRS = "#c0392b", "#1f618d", "#85929e"
TEXT = 'font-family="Helvetica, Arial, sans-serif"'


def seconds(value):
    if value >= 1:
        return f"{value:,.0f} s" if value >= 100 else f"{value:.3g} s"
    return f"{value * 1e3:.3g} ms"


def slope(line):
    """Of log t over log N, by least squares."""
    x, y = [math.log(n) for n, _ in line], [math.log(t) for _, t in line]
    mx, my = sum(x) / len(x), sum(y) / len(y)
    return sum((a - mx) * (b - my) for a, b in zip(x, y)) / sum((a - mx) ** 2 for a in x)


class Axes:
    def __init__(self, lines):
        sizes = [n for line in lines for n, _ in line]
        times = [t for line in lines for _, t in line]
        self.x_low, self.x_high = math.log10(min(sizes)) - 0.08, math.log10(max(sizes)) + 0.08
        self.y_low, self.y_high = math.floor(math.log10(min(times)) * 2) / 2, math.ceil(math.log10(max(times)) * 2) / 2

    def x(self, n):
        return LEFT + (math.log10(n) - self.x_low) / (self.x_high - self.x_low) * (WIDTH - LEFT - RIGHT)

    def y(self, t):
        return HEIGHT - BOTTOM - (math.log10(t) - self.y_low) / (self.y_high - self.y_low) * (HEIGHT - TOP - BOTTOM)


def grid(axes, title, note):
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{HEIGHT}" viewBox="0 0 {WIDTH} {HEIGHT}">',
           f'<rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>',
           f'<text x="{LEFT}" y="26" {TEXT} font-size="16" fill="#222">{title}</text>',
           f'<text x="{LEFT}" y="46" {TEXT} font-size="12" fill="#666">{note}</text>']
    for power in range(math.ceil(axes.y_low), math.floor(axes.y_high) + 1):
        at = axes.y(10.0 ** power)
        out.append(f'<line x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{at:.1f}" y2="{at:.1f}" stroke="#ddd"/>')
        out.append(f'<text x="{LEFT - 8}" y="{at + 4:.1f}" {TEXT} font-size="12" fill="#444" text-anchor="end">'
                   f'{seconds(10.0 ** power)}</text>')
    for power in range(math.ceil(axes.x_low), math.floor(axes.x_high) + 1):
        at = axes.x(10.0 ** power)
        out.append(f'<line x1="{at:.1f}" x2="{at:.1f}" y1="{TOP}" y2="{HEIGHT - BOTTOM}" stroke="#ddd"/>')
        out.append(f'<text x="{at:.1f}" y="{HEIGHT - BOTTOM + 20}" {TEXT} font-size="12" fill="#444" '
                   f'text-anchor="middle">{10 ** power:,}</text>')
    out.append(f'<text x="{(LEFT + WIDTH - RIGHT) / 2:.0f}" y="{HEIGHT - 14}" {TEXT} font-size="12" fill="#444" '
               f'text-anchor="middle">points</text>')
    return out


def text(x, y, color, words, size=12.5, anchor="start", weight=""):
    return (f'<text x="{x:.1f}" y="{y:.1f}" {TEXT} font-size="{size}" fill="{color}" text-anchor="{anchor}"{weight}>{words}'
            '</text>')


def draw(axes, line, color, width, dashed=""):
    points = " ".join(f"{axes.x(n):.1f},{axes.y(t):.1f}" for n, t in line)
    out = [f'<polyline points="{points}" fill="none" stroke="{color}" stroke-width="{width}"{dashed}/>']
    if not dashed:
        out += [f'<circle cx="{axes.x(n):.1f}" cy="{axes.y(t):.1f}" r="{width + 1}" fill="{color}"/>' for n, t in line]
    return out


def name(axes, at, color, label, line, anchor, dx, dy):
    """Beside the place `at`: what the line is, and its last point."""
    x, y = axes.x(at[0]) + dx, axes.y(at[1]) + dy
    return [text(x, y, color, label, 13.5, anchor, ' font-weight="bold"'),
            text(x, y + 17, color, f"{line[-1][0]:,} points in {seconds(line[-1][1])}", 12.5, anchor)]


def tell_slope(axes, power, color, line, dx, dy):
    """Beside the middle of a line, what it grows as."""
    middle = [math.exp(sum(math.log(p[a]) for p in (line[0], line[-1])) / 2) for a in (0, 1)]
    words = f'N<tspan dy="-5" font-size="10.5">{power:.2f}</tspan>'
    return [text(axes.x(middle[0]) + dx, axes.y(middle[1]) + dy, color, words, 14)]


def main():
    figures = json.load(open(sys.argv[2], encoding="utf-8"))
    rows = figures["rows"]
    fast = sorted((r["n"], r["fit_s"]) for r in rows if len(r["levels"]) > 1)
    dense = sorted((r["n"], r["factors_s"]) for r in rows if r["factors_s"])
    theirs = []
    if len(sys.argv) > 3:
        peers = json.load(open(sys.argv[3], encoding="utf-8"))["rows"]
        theirs = sorted((r["n"], r["fit_s"]) for r in peers
                        if r["way"] == "SciPy" and "fit_s" in r and r["scene"].startswith("values on a bumpy sphere"))
    steep = [p for p in dense if p[0] >= 2000] or dense
    beyond = [dense[-1], (100000, dense[-1][1] * (1e5 / dense[-1][0]) ** slope(steep))]
    axes = Axes([line for line in (fast, dense, beyond, theirs) if line])
    accuracy = max(r["residual_rows"] for r in rows if len(r["levels"]) > 1)
    points = figures.get("points", "bumpy sphere").split(",")[0]
    out = grid(axes, "The same global spline, two ways to fit it: time against points",
               f"points of a {points}, kernel r, {figures['threads']} threads; by iteration, residuals on 1000 rows summed "
               f"directly are at most {accuracy:.0e}")
    out += draw(axes, beyond, DENSE, 1.2, ' stroke-dasharray="5 5"')
    if theirs:
        out += draw(axes, theirs, THEIRS, 1.6)
        out += name(axes, theirs[-1], THEIRS, "SciPy, RBFInterpolator", theirs, "end", -12, -6)
    out += draw(axes, dense, DENSE, 2.2)
    out += name(axes, beyond[-1], DENSE, "by factors (Cholesky)", dense, "start", 14, 8)
    out.append(text(axes.x(beyond[-1][0]) + 14, axes.y(beyond[-1][1]) + 42, DENSE,
                    f"{beyond[-1][0]:,} would take {beyond[-1][1] / 60:.0f} minutes"))
    out += tell_slope(axes, slope(steep), DENSE, beyond, 12, 8)
    out += draw(axes, fast, FAST, 3)
    out += name(axes, fast[-1], FAST, "by iteration on fast sums", fast, "start", 14, 0)
    even = [p for p in fast if p[0] >= 10000]
    out += tell_slope(axes, slope(even), FAST, even, 8, 26)
    out.append("</svg>")
    with open(sys.argv[1], "w", encoding="utf-8") as file:
        file.write("\n".join(out) + "\n")


main()
