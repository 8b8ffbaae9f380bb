"""Rays and pixels a second beside OpenCV's, in one run on one core.

Runs the benchmark `camera`, times OpenCV's Python package on the same cameras, pixels and points,
and prints nanoseconds a point with their ratios; the shortest of many runs counts on both sides,
since other programs only ever add. Needs Python 3.11 and opencv-python-headless.
"""

import json
import os
import pathlib
import shutil
import subprocess
import time
import tomllib

import cv2
import numpy as np

PACKAGE = pathlib.Path(__file__).resolve().parent.parent
MODELS = ("pinhole", "brown_conrady", "fisheye")
# Iterations until the picture agrees to 1e-8 pixels, as far as they get in 200.
TIGHT = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 200, 1e-8)


def pin():
    """Keeps this process and its children on one core."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})


def cargo(*arguments):
    command = [os.environ.get("CARGO", "cargo"), *arguments]
    return subprocess.run(command, cwd=PACKAGE, check=True, stdout=subprocess.PIPE, text=True)


def rockmap(names):
    """Nanoseconds a point by camera and operation."""
    only = "|".join(names)
    options = ["--warm-up-time", "0.2", "--measurement-time", "0.5", "--sample-size", "50"]
    folder = json.loads(cargo("metadata", "--format-version", "1", "--no-deps").stdout)
    results = pathlib.Path(folder["target_directory"]) / "criterion" / "camera"
    shutil.rmtree(results, ignore_errors=True)
    # Compiled on all cores, measured on one.
    cargo("bench", "--bench", "camera", "--no-run")
    pin()
    cargo("bench", "--bench", "camera", "--", "--noplot", *options, f"camera/({only})/")
    times = {}
    for path in results.glob("*/new/benchmark.json"):
        about = json.loads(path.read_text())
        sample = json.loads(path.with_name("sample.json").read_text())
        runs = zip(sample["times"], sample["iters"])
        shortest = min(spent / iterations for spent, iterations in runs)
        times[about["function_id"]] = shortest / about["throughput"]["Elements"]
    return times


def shortest(run, count):
    """Nanoseconds a point of the shortest of many runs."""
    best = np.inf
    for _ in range(200):
        begin = time.perf_counter()
        run()
        best = min(best, time.perf_counter() - begin)
        if best > 5e-3:
            break
    return best / count * 1e9


class OpenCv:
    """A camera as OpenCV has it, with the pixels of the benchmark."""

    def __init__(self, camera):
        matrix = [[camera["fx"], 0, camera["cx"]], [0, camera["fy"], camera["cy"]], [0, 0, 1]]
        self.matrix = np.array(matrix, dtype=float)
        self.distortion = np.array(camera.get("distortion", [0, 0, 0, 0]), dtype=float)
        self.fisheye = camera["model"] == "fisheye"
        shares = (np.arange(64) + 0.5) / 64
        u, v = np.meshgrid(shares * camera["width"] - 0.5, shares * camera["height"] - 0.5)
        self.pixels = np.stack([u, v], -1).reshape(-1, 1, 2)
        plane = self.undistort(TIGHT)
        self.points = np.concatenate([plane, np.ones_like(plane[..., :1])], -1) * 5.0

    def undistort(self, criteria=None):
        k, d = self.matrix, self.distortion
        if self.fisheye:
            if criteria is None:
                return cv2.fisheye.undistortPoints(self.pixels, k, d)
            return cv2.fisheye.undistortPoints(self.pixels, k, d, criteria=criteria)
        if criteria is None:
            return cv2.undistortPoints(self.pixels, k, d)
        return cv2.undistortPoints(self.pixels, k, d, criteria=criteria)

    def project(self):
        """With derivatives by all parameters, which the Python functions always compute."""
        zero = np.zeros(3)
        module = cv2.fisheye if self.fisheye else cv2
        return module.projectPoints(self.points, zero, zero, self.matrix, self.distortion)[0]

    def error_px(self, criteria=None):
        """How far its undistorted pixels are from where they came from."""
        plane = self.undistort(criteria)
        self.points = np.concatenate([plane, np.ones_like(plane[..., :1])], -1)
        return np.nanmax(np.linalg.norm(self.project() - self.pixels, axis=-1))


def table(title, header, rows):
    print(f"\n{title}")
    rows = [header] + rows
    widths = [max(len(row[i]) for row in rows) for i in range(len(header))]
    for row in rows:
        cells = [row[0].ljust(widths[0])]
        cells += [cell.rjust(width) for cell, width in zip(row[1:], widths[1:])]
        print("  ".join(cells))


def main():
    cameras = tomllib.loads((PACKAGE / "tests/camera/cameras.toml").read_text())["cameras"]
    cameras = {name: c for name, c in cameras.items() if c["model"] in MODELS}
    ours = rockmap(cameras)
    cv2.setNumThreads(1)
    rays, pixels = [], []
    for name, camera in cameras.items():
        theirs = OpenCv(camera)
        count = len(theirs.pixels)
        ray = ours[f"{name}/rays"]
        project = shortest(theirs.project, count)
        row = [name, f"{ray:.1f}"]
        for criteria in (None, TIGHT):
            spent = shortest(lambda: theirs.undistort(criteria), count)
            row += [f"{spent:.1f}", f"{spent / ray:.2f}", f"{theirs.error_px(criteria):.0e}"]
        rays.append(row)
        pixel, derived = ours[f"{name}/pixels"], ours[f"{name}/pixel_with_jacobian"]
        row = [name, f"{pixel:.1f}", f"{derived:.1f}", f"{project:.1f}"]
        pixels.append(row + [f"{project / pixel:.2f}", f"{project / derived:.2f}"])
    print(f"\nOpenCV {cv2.__version__}, one core; nanoseconds a point, and how many times ours go")
    print("into OpenCV's: above 1 ours is faster")
    table(
        "pixels to rays: undistortPoints as it comes, and to 1e-8 px; its largest error, px",
        ["camera", "rays", "default", "ratio", "error", "1e-8 px", "ratio", "error"],
        rays,
    )
    table(
        "points to pixels: projectPoints (with its derivatives)",
        ["camera", "pixels", "with derivatives", "projectPoints", "ratio", "ratio"],
        pixels,
    )


if __name__ == "__main__":
    main()
