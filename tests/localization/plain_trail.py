"""A pose led along a trail of scans as `trail_fit` does, written plainly: matrices, and every reflector of the map."""

from __future__ import annotations

import math

import numpy as np

from commission.geometry import se2
from commission.geometry.angles import wrap
from commission.localization.observation import jacobians, range_bearing
from commission.localization.trail import way_between


class PlainPose:
    """A pose, and what it has explained so far; the scanner sees 30 degrees to either side."""

    def __init__(self, mean, p, setup, longest):
        self.mean, self.p, self.longest = mean, p, longest
        self.centers, self.mounting = setup.reflectors.centers, setup.scanners[0].mounting
        model, survey = setup.observations[0], {tuple(row[:2]): row[2] for row in setup.index.places}
        self.noise = 2.25 * np.diag((model.range_variance, model.bearing_variance))
        self.survey = [survey[tuple(center)] for center in self.centers]
        self.gains, self.best = np.zeros(len(self.centers)), np.zeros(len(self.centers))
        self.strange, self.share, self.total, self.visible = [], 0.0, 0.0, 1
        self.met = {j: [] for j in range(len(self.centers))}
        """Weight of each detection of a reflector, how far beside it it lies [m], and its noise there [m^2]."""

    def lead(self, trail, *, forth):
        """Lead it from the first scan to the last, or back."""
        before, since = None, math.inf
        for k in range(len(trail.scans)) if forth else range(len(trail.scans) - 1, -1, -1):
            scan, counts = trail.scans[k], 1.0
            if before is not None:
                way = way_between(before, scan)
                counts, since = min(way, 1.0), since + way
                self.move(before, scan)
            before = scan
            if since >= 0.5:
                view, since = range_bearing(self.mean, self.mounting, self.centers), 0.0
                seen = (np.abs(view[:, 1]) <= math.radians(30.0)) & (view[:, 0] <= self.longest)
                self.visible = max(seen.sum(), 1)
            for z in trail.seen[int(trail.scans[k - 1, 7]) if k else 0 : int(scan[7])]:
                self.see(z, counts)

    def move(self, before, scan):
        """Go along with odometry."""
        moved = se2.compose(self.mean, se2.compose(se2.inverse(before[1:4]), scan[1:4]))
        jacobian, (position, heading) = np.eye(3), np.abs(scan[4:6] - before[4:6])
        jacobian[:2, 2] = -(moved[1] - self.mean[1]), moved[0] - self.mean[0]
        self.mean = moved
        self.p = jacobian @ self.p @ jacobian.T + np.diag((position, position, heading))

    def options(self, z, place, counts):
        """Reflectors that a detection may be of: number, likelihood, correction and covariance after it."""
        for j, center in enumerate(self.centers):
            h, expected = (
                jacobians(self.mean, self.mounting, center)[0],
                range_bearing(self.mean, self.mounting, center),
            )
            v = z - expected[0]
            v[1] = wrap(v[1])
            at = self.survey[j] * np.diag((1.0, 1.0 / expected[0, 0] ** 2))
            s = h @ self.p @ h.T + self.noise + at
            d2 = v @ np.linalg.solve(s, v)
            if d2 > 16.0 or math.hypot(*(center - place)) > 2.0:
                continue
            louder = h @ self.p @ h.T + self.noise / max(counts, 0.02) + at
            gain = self.p @ h.T @ np.linalg.inv(louder)
            likelihood = math.exp(-0.5 * d2) / (2.0 * math.pi * math.sqrt(np.linalg.det(s)))
            yield j, likelihood, gain @ v, self.p - gain @ louder @ gain.T

    def see(self, z, counts):
        """Take in a detection."""
        sensor = se2.compose(self.mean, self.mounting)
        place = sensor[:2] + z[0] * np.array((math.cos(sensor[2] + z[1]), math.sin(sensor[2] + z[1])))
        options = list(self.options(z, place, counts))
        odds = 0.8 * math.radians(60.0) * (self.longest - 0.1) / self.visible
        every = sum(each[1] for each in options)
        ratio = 0.2 + odds * every
        self.total += counts
        self.share += counts * (1.0 - 0.2 / ratio)
        if ratio < 1.0:
            at = next((each for each in self.strange if math.hypot(*(each[0] - place)) <= 0.5), None)
            if at is None:
                at = [place, 0.0]
                self.strange.append(at)
            at[1] += counts * math.log(ratio)
        for j, likelihood, _, _ in options if ratio >= 1.0 else ():
            self.gains[j] += counts * math.log(ratio) * likelihood / every
            if likelihood / every > 0.1:
                self.best[j] = max(self.best[j], math.log(ratio))
        weights = [0.2 / ratio] + [odds * each[1] / ratio for each in options]
        shifts, spreads = [np.zeros(3), *(each[2] for each in options)], [self.p, *(each[3] for each in options)]
        shift = sum(w * d for w, d in zip(weights, shifts, strict=True))
        p = sum(w * (c + np.outer(d, d)) for w, d, c in zip(weights, shifts, spreads, strict=True))
        self.p, self.mean = p - np.outer(shift, shift), self.mean + shift
        self.mean[2] = wrap(self.mean[2])
        sensor = se2.compose(self.mean, self.mounting)
        direction = sensor[2] + z[1]
        ray, across = np.array(
            ((math.cos(direction), math.sin(direction)), (-math.sin(direction), math.cos(direction)))
        )
        noise = self.noise[0, 0] * np.outer(ray, ray) + self.noise[1, 1] * z[0] ** 2 * np.outer(across, across)
        for weight, (j, *_) in zip(weights[1:], options, strict=True):
            self.met[j].append((counts * weight, sensor[:2] + z[0] * ray - self.centers[j], noise))

    def beside(self):
        """How many reflectors were met, how many of them not where they are on average, and how far, squared."""
        seen, beside, squares = set(), set(), []
        for j, rows in self.met.items():
            n = sum(row[0] for row in rows)
            if n < 1.0:
                continue
            seen.add(j)
            mean = sum(w * off for w, off, _ in rows) / n
            noise = sum(w * each for w, _, each in rows) / n
            squares.append(0.5 * (mean @ mean - np.trace(noise) / n))
            if mean @ np.linalg.solve(noise / n + self.survey[j] * np.eye(2), mean) > 16.0:
                beside.add(j)
        return len(seen), len(beside), max(float(np.mean(squares)), 0.0)

    def told(self):
        """Evidence, share and places, see `Explained`."""
        apart = np.hypot(*(self.centers[:, np.newaxis] - self.centers[np.newaxis]).transpose(2, 0, 1))
        crowd, seen = 1.0 / (apart <= 0.5).sum(axis=1), self.gains > 0.0
        bound = (self.best + 1.5) * crowd
        evidence = sum(max(each[1], -1.6) for each in self.strange) + np.minimum(self.gains, bound).sum()
        places = float((np.minimum(1.0, self.gains[seen] / (0.5 * bound[seen])) * crowd[seen]).sum())
        return evidence, self.share / self.total, places
