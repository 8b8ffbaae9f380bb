"""Scenes and reference bounds for tests/bounds.rs, by the Python prototype of the fusion.

    python3 tests/reference/bounds.py PROTOTYPE small tests/data/bounds/small.json
    python3 tests/reference/bounds.py PROTOTYPE default default.json

PROTOTYPE is the folder of the prototype (sim.py, mvbp.py, bounds.py); numpy and scipy are needed.
Not run by the test suite: its results stand under tests/data/bounds.

The prototype adds its pose errors to Euler angles. Here its solvers run, unchanged, on a camera
whose pose error is that of the data formats: position in ENU and a rotation vector in body axes,
R = R0 Exp(delta). Pixels are written with the centre of the top-left one at (0, 0).

The three-dimensional case is solved by scipy's least_squares, which shares nothing with either.
"""
import json
import sys

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

sys.path.insert(0, sys.argv[1])
sys.argv = sys.argv[:1] + sys.argv[2:]
import bounds  # noqa: E402
import sim  # noqa: E402
from mvbp import Fuse  # noqa: E402

SIGMA = np.array([0.05, 0.05, 0.02, *np.radians([0.25, 0.25, 0.4])])
SCENES = dict(
    small=dict(seed=4, nrock=110, L=5, nviews=8, maxr=14, ybox=7),
    default=dict(seed=0),
    long=dict(seed=1, nrock=2500, L=160, nviews=300),
)


def skew(v):
    out = np.zeros(v.shape[:-1] + (3, 3))
    out[..., 0, 1], out[..., 0, 2] = -v[..., 2], v[..., 1]
    out[..., 1, 0], out[..., 1, 2] = v[..., 2], -v[..., 0]
    out[..., 2, 0], out[..., 2, 1] = -v[..., 1], v[..., 0]
    return out


def right_jacobian(r):
    """d Exp(r) = Exp(r) [J dr]x."""
    a = np.linalg.norm(r, axis=-1)[..., None, None]
    small = a < 1e-6
    a = np.where(small, 1.0, a)
    k = skew(r)
    first = np.where(small, 0.5, (1 - np.cos(a)) / a**2)
    second = np.where(small, 1 / 6, (a - np.sin(a)) / a**3)
    return np.eye(3) - first * k + second * (k @ k)


class Camera(sim.Cam):
    """The prototype's camera with the pose error of the data formats."""

    def __init__(self, attitude):
        self.attitude = attitude

    def axes(self, poses, view):
        r = poses[view, 3:]
        return self.attitude[view] @ Rotation.from_rotvec(r).as_matrix(), right_jacobian(r)

    def proj(self, poses, view, places, jac=True):
        places = np.asarray(places)
        if places.shape[1] == 2:
            places = np.c_[places, np.zeros(len(places))]
        rotation, turn = self.axes(poses, view)
        body = np.einsum("nji,nj->ni", rotation, places - poses[view, :3])
        c = body @ sim.CAM.T
        z = np.maximum(c[:, 2], 0.05)
        h = np.c_[sim.F * c[:, 0] / z + sim.W / 2, sim.F * c[:, 1] / z + sim.H / 2]
        if not jac:
            return h, c[:, 2]
        d = np.zeros((len(c), 2, 3))
        d[:, 0, 0] = d[:, 1, 1] = sim.F / z
        d[:, 0, 2], d[:, 1, 2] = -sim.F * c[:, 0] / z**2, -sim.F * c[:, 1] / z**2
        by_body = d @ sim.CAM
        by_place = by_body @ rotation.transpose(0, 2, 1)
        return h, c[:, 2], by_place[:, :, :2], np.concatenate([-by_place, by_body @ skew(body) @ turn], 2)

    def ground(self, poses, view, u):
        rotation, _ = self.axes(poses, view)
        c = np.c_[(u[:, 0] - sim.W / 2) / sim.F, (u[:, 1] - sim.H / 2) / sim.F, np.ones(len(u))]
        d = np.einsum("nij,nj->ni", rotation, c @ sim.CAM)
        t = -poses[view, 2] / np.minimum(d[:, 2], -1e-3)
        return poses[view, :2] + d[:, :2] * t[:, None]


def tilted(data, truth, slope, height_sigma_m, camera, start):
    """Joint least squares of points with a height prior over a sloping plane, by scipy."""
    keep = truth["ids"] >= 0
    rocks, k = np.unique(truth["ids"][keep], return_inverse=True)
    u, view, n = data["u"][keep], data["vid"][keep], len(data["meas"])

    def split(x):
        return x[: 3 * len(rocks)].reshape(-1, 3), data["meas"] + x[3 * len(rocks):].reshape(n, 6) * SIGMA

    def residuals(x):
        places, poses = split(x)
        h, _ = camera.proj(poses, view, places[k], False)
        height = places[:, 2] - places[:, :2] @ slope
        return np.r_[((u - h) / 1.5).ravel(), x[3 * len(rocks):], height / height_sigma_m]

    x0 = np.r_[np.c_[start, start @ slope].ravel(), np.zeros(6 * n)]
    fit = least_squares(residuals, x0, jac="3-point", x_scale="jac", xtol=1e-15, ftol=1e-15, gtol=1e-15)
    cov = np.linalg.inv(fit.jac.T @ fit.jac)
    places, _ = split(fit.x)
    blocks = [cov[3 * i: 3 * i + 3, 3 * i: 3 * i + 3] for i in range(len(rocks))]
    return dict(slope=slope.tolist(), height_sigma_m=height_sigma_m, cost=2 * fit.cost,
                place=rounded(places), covariance=rounded(np.array(blocks), 12))


def rounded(a, digits=10):
    return np.round(np.asarray(a, float), digits).tolist()


def main(name, path):
    data, truth = sim.scene(**SCENES[name])
    measured = data["meas"]
    m, _ = sim.rotd(measured)
    attitude = (sim.CAM.T @ m).transpose(0, 2, 1)
    camera = Camera(attitude)
    data = dict(data, cam=camera, meas=np.c_[measured[:, :3], np.zeros((len(measured), 3))])
    # Exactly what is written, so that rounding plays no part.
    for key in ("meas", "u", "ld"):
        data[key] = np.round(data[key], 10)
    data["u"] = np.round(data["u"], 6)
    quaternion = Rotation.from_matrix(attitude).as_quat(scalar_first=True)
    places, (cov, _), rocks, poses = sim.oracle(data, truth, psig=SIGMA, iters=12)
    kept = {}
    original = Fuse.finish

    def finish(fuse):
        out = original(fuse)
        kept["fuse"] = fuse
        return out

    Fuse.finish = finish
    mu, fair_cov, r = bounds.fair(data, truth, psig=SIGMA, maxr=14)
    f = kept["fuse"]
    out = dict(
        scene=name,
        camera=dict(width=sim.W, height=sim.H, f=sim.F, cx=sim.W / 2 - 0.5, cy=sim.H / 2 - 0.5),
        sigma=SIGMA.tolist(),
        area_m2=f.area(),
        share=float(f.effarea()),
        position=rounded(data["meas"][:, :3]),
        quaternion=rounded(quaternion, 16),
        view=data["vid"].tolist(),
        pixel=rounded(data["u"] - 0.5, 6),
        log_size=rounded(data["ld"]),
        object=truth["ids"].tolist(),
        truth=rounded(truth["T"], 6),
        clairvoyant=dict(object=rocks.tolist(), place=rounded(places), covariance=rounded(cov, 12),
                         pose=rounded(poses - data["meas"], 12)),
        fair=dict(group=f.own.tolist(), place=rounded(mu), covariance=rounded(fair_cov, 12), p_exist=rounded(r, 12),
                  pixel_px=f.sig2**0.5, clutter=f.lam * f.areapx, density=f.rho, pose_scale=rounded(f.psc, 12),
                  size=[f.ms, f.vs], clutter_size=[f.mc, f.vc], detectability=rounded(f.pdb, 12)),
    )
    if name == "small":
        slope = np.array([0.05, -0.03])
        out["tilted"] = tilted(data, truth, slope, 0.05, camera, places)
    with open(path, "w") as file:
        json.dump(out, file, separators=(",", ":"))
        file.write("\n")
    seen = truth["T"][truth["seen"] > 0]
    print("pixel %.4f clutter %.3f density %.4f" % (f.sig2**0.5, f.lam * f.areapx, f.rho), f.psc, f.pdb)
    print(name, len(data["u"]), "detections,", len(rocks), "objects; GOSPA clairvoyant %.4f fair %.4f; RMSE %.4f"
          % (sim.gospa(seen, places), sim.gospa(seen, mu[r > 0.5]), sim.report(seen, places)["rmse"]))


if __name__ == "__main__":
    main(*sys.argv[1:])
