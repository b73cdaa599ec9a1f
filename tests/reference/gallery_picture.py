#!/usr/bin/env python3
"""The picture of a finding in a report, as a file of its own: what is left without the finding, and what is left with it.

    python3 tests/reference/gallery_picture.py REPORT.html FINDING OUT.svg

FINDING counts from 1, as in the report. One point in three is drawn. Needs no packages.
"""
import re
import sys

STYLE = """text{font:11px sans-serif;fill:#5b6470}.mid{text-anchor:middle}.end{text-anchor:end}.axis,.head{font-size:12px;fill:#1b2026}
path{fill:none}.grid{stroke:#e8ebef}.base,.zero{stroke:#8b929c}.whisker{stroke:#1c63d4;opacity:.25}
.s0{fill:#8b929c}.fitted{opacity:.35}.s-last{fill:#1c63d4}"""


def main():
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
