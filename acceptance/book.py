"""Does what the README and the tutorial tell a newcomer to do, word by word, and compares what comes.

    book.py ROCKMAP FOLDER PAGE.md...

Files that a page shows under their names are written, console blocks are typed, Python and JSON
blocks are held against what the runs before them wrote. `...` stands for anything. FOLDER is made
anew, with this package's fixtures and pipelines; `make` is left out.
"""

import re
import shutil
import subprocess
import sys
from pathlib import Path

BLOCK = re.compile(r"^```(\w+)\n(.*?)^```", re.MULTILINE | re.DOTALL)


def fault(page, what, *lines):
    sys.exit("\n".join([f"{page}: {what}", *lines]))


def commands(block):
    """Every command of a console block, and what the page says it prints."""
    typed = []
    for line in block.splitlines():
        if line.startswith("$ "):
            typed.append((re.split(r"\s{2,}#", line[2:])[0].strip(), []))
        elif typed:
            typed[-1][1].append(line.rstrip())
    return typed


def matches(printed, wanted):
    """Whether these lines are the first, in a row but for `...`."""
    if not wanted:
        return True
    if wanted[0] == "...":
        return any(matches(printed[k:], wanted[1:]) for k in range(len(printed) + 1))
    return bool(printed) and printed[0] == wanted[0] and matches(printed[1:], wanted[1:])


def run(page, command, wanted, rockmap, folder):
    words = command.split()
    if words[0] == "make":
        return False
    if words[0] not in ("rockmap", "target/release/rockmap"):
        fault(page, f"`{command}` is no command of this program")
    done = subprocess.run(
        [rockmap, *words[1:]], cwd=folder, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
    )
    printed = [line.rstrip() for line in done.stdout.splitlines()]
    if done.returncode != 0:
        fault(page, f"`{command}` ends with {done.returncode}", *printed)
    if wanted and not matches(printed, ["...", *wanted]):
        fault(page, f"`{command}` prints", *printed, "where the page has", *wanted)
    return True


def check_json(page, block, folder):
    """The page's JSON, up to what it leaves out, is in a map of the runs so far."""
    shown = re.sub(r"\s", "", block.split("...")[0]).rstrip(",")
    for path in sorted(folder.glob("*/map/*.geojson")):
        if shown in re.sub(r"\s", "", path.read_text()):
            return
    fault(page, "no map holds this", block)


def check(page, rockmap, folder):
    text = page.read_text()
    count = {"commands": 0, "files": 0, "others": 0}
    pages_files = folder
    for block in BLOCK.finditer(text):
        kind, content = block.groups()
        before = text[: block.start()].rstrip().rsplit("\n\n", 1)[-1]
        named = re.match(r"`([\w-]+\.\w+)`", before)
        section = text[: block.start()]
        # A section that says where its files go.
        into = re.findall(r"folder `([\w-]+)/`", section)
        if into:
            pages_files = folder / into[-1]
            pages_files.mkdir(exist_ok=True)
        if kind in ("csv", "toml") and named and into:
            (pages_files / named[1]).write_text(content)
            count["files"] += 1
        elif kind == "toml":
            # What a page calls the same as a pipeline that is shipped gives the same map.
            (folder / "pipelines/example.toml").write_text(content)
            count["files"] += 1
        elif kind == "console":
            for command, wanted in commands(content):
                count["commands"] += run(page, command, wanted, rockmap, folder)
        elif kind == "python":
            subprocess.run([sys.executable, "-c", content], cwd=folder, check=True)
            count["others"] += 1
        elif kind == "json":
            check_json(page, content, folder)
            count["others"] += 1
    if (folder / "pipelines/example.toml").exists():
        same_map(page, rockmap, folder)
    print(f"{page}: " + ", ".join(f"{n} {what}" for what, n in count.items()) + " as the page says")


def same_map(page, rockmap, folder):
    """The pipeline file the README shows, and the one it says gives the same map."""
    maps = []
    for name in ("example", "mast-camera"):
        options = ["--out", f"outputs/same-{name}", "--force", "--quiet"]
        subprocess.run([rockmap, "run", f"pipelines/{name}.toml", *options], cwd=folder, check=True)
        rocks = (folder / f"outputs/same-{name}/rocks.geojson").read_text()
        maps.append(re.sub(r'"run_id":"\w+"', "", rocks))
    if maps[0] != maps[1]:
        fault(page, "the pipeline file it shows gives another map than pipelines/mast-camera.toml")
    (folder / "pipelines/example.toml").unlink()


def main(rockmap, folder, *pages):
    folder = Path(folder)
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for name in ("fixtures", "pipelines"):
        shutil.copytree(name, folder / name)
    for page in pages:
        check(Path(page), str(Path(rockmap).resolve()), folder)


if __name__ == "__main__":
    main(*sys.argv[1:])
