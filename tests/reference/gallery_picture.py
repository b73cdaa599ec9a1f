#!/usr/bin/env python3
"""A picture of a report, or of the page of `calib diagnose --html`, as a file of its own.

    python3 tests/reference/gallery_picture.py REPORT.html FINDING OUT.svg
    python3 tests/reference/gallery_picture.py PAGE.html causes OUT.svg

Of a finding, which counts from 1 as in the report: the residual without it, and with it; one point in three is drawn. `causes` is
the table of causes with what was found. Needs no packages.
"""
import re
import sys

STYLE = """text{font:11px sans-serif;fill:#5b6470}.mid{text-anchor:middle}.end{text-anchor:end}.axis,.head{font-size:12px;fill:#1b2026}
path{fill:none}.grid{stroke:#e8ebef}.base,.zero{stroke:#8b929c}.whisker{stroke:#1c63d4;opacity:.25}
.s0{fill:#8b929c}.fitted{opacity:.35}.s-last{fill:#1c63d4}"""

TABLE = """text{font:12px sans-serif;fill:#5b6470}.title{font-size:14px;font-weight:bold;fill:#1b2026}.mid{text-anchor:middle}
.place{fill:#1b2026}.found{text-anchor:middle;fill:#1b2026}.line{stroke:#e8ebef}.open{stroke:#8a5a00;stroke-dasharray:4 3}"""
SIZES = ["#eef3f4", "#dcebee", "#d0ebe6", "#e2eccd", "#f6e8c0", "#f8d3b2", "#f0b9b6"]


def causes(page, out):
    """The table of causes: places down, kinds of variable across."""
    with open(page, encoding="utf-8") as file:
        text = file.read()
    table = re.search(r'<div class="causes">.*?</table>', text, re.S).group(0)
    caption = re.sub(r"<[^>]*>", "", re.search(r"<caption>(.*?)</caption>", table, re.S).group(1))
    heads = re.findall(r'<th scope="col">(.*?)</th>', table)
    wide, high, left = 190, 26, 100
    width, y = left + wide * len(heads[1:]) + 10, 66
    parts = [f'<text class="title" x="10" y="24">{caption}</text>']
    for k, head in enumerate(heads[1:]):
        parts.append(f'<text class="mid" x="{left + wide * (k + 0.5)}" y="52">{head}</text>')
    for place, cells in re.findall(r'<tr><th scope="row">(.*?)</th>(.*?)</tr>', table, re.S):
        parts.append(f'<path class="line" d="M10 {y - 6}H{width - 10}"/><text class="place" x="10" y="{y + 12}">{place}</text>')
        for k, (kind, cell) in enumerate(re.findall(r'<td class="(.*?)">(.*?)</td>', cells, re.S)):
            x, size = left + wide * k, re.search(r"size(\d)", kind)
            if size:
                size_um, name = re.match(r"(.*?)<span>(.*?)</span>", cell, re.S).groups()
                edge = ' class="open"' if "open" in kind else ""
                parts.append(f'<rect{edge} x="{x + 2}" y="{y - 5}" width="{wide - 4}" height="{high - 2}" fill="{SIZES[int(size.group(1))]}"/>')
                parts.append(f'<text class="found" x="{x + wide / 2}" y="{y + 12}">{size_um} {name}</text>')
            elif cell:
                parts.append(f'<text class="mid" x="{x + wide / 2}" y="{y + 12}">{cell}</text>')
        y += high
    with open(out, "w", encoding="utf-8") as file:
        file.write(f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {y + 4}" role="img">\n<style>{TABLE}</style>\n')
        file.write(f'<rect width="{width}" height="{y + 4}" fill="#ffffff"/>\n' + "\n".join(parts) + "\n</svg>\n")


def main():
    if sys.argv[2] == "causes":
        return causes(sys.argv[1], sys.argv[3])
    report, number, out = sys.argv[1], int(sys.argv[2]), sys.argv[3]
    with open(report, encoding="utf-8") as file:
        charts = re.findall(r'<svg class="chart".*?</svg>', file.read(), re.S)
    pictures = [chart for chart in charts if re.search(r"<title>With(out)? the finding", chart)]
    pair = pictures[2 * number - 2:2 * number]
    if len(pair) < 2:
        raise SystemExit(f"{report} has {len(pictures) // 2} findings with a picture")
    parts = []
    for k, chart in enumerate(pair):
        title = re.search(r"<title>(.*?)</title>", chart).group(1)
        body = re.sub(r"^<svg[^>]*>\s*<title>.*?</title>|</svg>$", "", chart, flags=re.S)
        lines = body.split("\n")
        marks = [i for i, line in enumerate(lines) if 'class="dot' in line or 'class="whisker' in line]
        gone = {i for n, i in enumerate(marks) if n % 3}
        kept = "\n".join(line for i, line in enumerate(lines) if i not in gone)
        head = title.split(",")[0].replace("Without the finding:", "without").replace("With the finding:", "with")
        parts.append(f'<g transform="translate({430 * k} 22)">\n<text class="head mid" x="229" y="-6">{head}</text>{kept}</g>')
    with open(out, "w", encoding="utf-8") as file:
        file.write(f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 850 292" role="img">\n<style>{STYLE}</style>\n')
        file.write('<rect width="850" height="292" fill="#ffffff"/>\n' + "\n".join(parts) + "\n</svg>\n")


if __name__ == "__main__":
    main()
