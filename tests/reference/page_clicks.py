#!/usr/bin/env python3
"""How long interactions with a fleet's page take in a browser, from the event to the next frame, and its pictures at two widths.

    python3 tests/reference/page_clicks.py PAGE.html OUT [--browser chromium]      (pip install websocket-client)

Clicks each head of the table of robots and types into its search, six times each; prints the median and the longest in ms, and the
median of what the page's thread computed for it: on a machine that does other things the rest is waiting.
"""

import argparse
import base64
import json
import pathlib
import statistics
import subprocess
import tempfile
import time
import urllib.request

import websocket

TIMED = """(async (act) => {
  const frame = () => new Promise((done) => requestAnimationFrame(() => setTimeout(done)));
  await frame();
  const begun = performance.now();
  act();
  document.body.getBoundingClientRect();
  await frame();
  return performance.now() - begun;
})"""


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("page")
    parser.add_argument("out")
    parser.add_argument("--browser", default="chromium")
    args = parser.parse_args()
    pathlib.Path(args.out).mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as profile:
        command = [args.browser, "--headless=new", "--no-sandbox", "--disable-gpu", "--remote-debugging-port=9333", "--remote-allow-origins=*",
                   f"--user-data-dir={profile}", "about:blank"]
        browser = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            measure(args)
        finally:
            browser.terminate()
            browser.wait()


def measure(args):
    for _ in range(100):
        try:
            tabs = json.load(urllib.request.urlopen("http://127.0.0.1:9333/json"))
            break
        except OSError:
            time.sleep(0.2)
    tab = next(tab for tab in tabs if tab["type"] == "page")
    socket, number = websocket.create_connection(tab["webSocketDebuggerUrl"]), [0]

    def send(method, **given):
        number[0] += 1
        socket.send(json.dumps({"id": number[0], "method": method, "params": given}))
        while True:
            answer = json.loads(socket.recv())
            if answer.get("id") == number[0]:
                return answer["result"]

    def value(expression):
        return send("Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True)["result"].get("value")

    def computed():
        metrics = send("Performance.getMetrics")["metrics"]
        return 1e3 * next(one["value"] for one in metrics if one["name"] == "TaskDuration")

    send("Performance.enable", timeDomain="threadTicks")
    for width in (400, 1280):
        send("Emulation.setDeviceMetricsOverride", width=width, height=900, deviceScaleFactor=1, mobile=width < 640)
        send("Page.navigate", url=pathlib.Path(args.page).resolve().as_uri())
        while value("document.readyState") != "complete":
            time.sleep(0.2)
        rows, wide = value("document.querySelectorAll('#robots tbody tr').length"), value("document.documentElement.scrollWidth")
        acts = {f"head {k}": f"document.querySelectorAll('#robots thead button')[{k}].click()" for k in range(value("document.querySelectorAll('#robots thead button').length"))}
        typed = lambda text: f"(s => {{ s.value = '{text}'; s.dispatchEvent(new Event('input')); }})(document.getElementById('search'))"
        acts |= {"search": typed("r1"), "search emptied": typed("")}
        print(f"{width} px, {rows} robots, content {wide} px wide")
        for name, act in acts.items():
            times, works = [], []
            for _ in range(6):
                before = computed()
                times.append(value(f"{TIMED}(() => {act})"))
                works.append(computed() - before)
            print(f"  {name}: median {statistics.median(times):.0f} ms, longest {max(times):.0f} ms, computing {statistics.median(works):.0f} ms")
        for part, y in (("top", 0), ("table", value("document.getElementById('robots').getBoundingClientRect().top + scrollY - 120"))):
            value(f"scrollTo(0, {y})")
            picture = send("Page.captureScreenshot", format="png")["data"]
            pathlib.Path(args.out, f"{width}-{part}.png").write_bytes(base64.b64decode(picture))


if __name__ == "__main__":
    main()
