"""EKF-SLAM as a textbook has it, slow and dense: what the joint state of temporary landmarks is compared with."""

# pyright: basic

from __future__ import annotations

import math

import numpy as np

from commission.geometry.angles import wrap


class PlainSlam:
    """EKF-SLAM as a textbook has it: one dense state, inverses, no structure (Thrun, Burgard and Fox 2005, 10.2)."""

    def __init__(self, mean, covariance):
        self.mean, self.P = np.array(mean), np.array(covariance)

    def predict(self, moved, noise):
        F = np.eye(len(self.mean))
        F[:2, 2] = -moved[1], moved[0]
        self.mean[:2] += moved[:2]
        self.mean[2] = wrap(self.mean[2] + moved[2])
        self.P = F @ self.P @ F.T
        self.P[:3, :3] += noise

    def correct(self, residual, H, R):
        S = H @ self.P @ H.T + R
        K = self.P @ H.T @ np.linalg.inv(S)
        self.mean = self.mean + K @ residual
        self.mean[2] = wrap(self.mean[2])
        self.P = (np.eye(len(self.mean)) - K @ H) @ self.P
        return float(residual @ np.linalg.solve(S, residual))

    def rotation(self):
        c, s = math.cos(self.mean[2]), math.sin(self.mean[2])
        return np.array(((c, -s), (s, c)))

    def sight(self, k, z, R):
        at, Rt = 3 + 2 * k, self.rotation().T
        h = Rt @ (self.mean[at : at + 2] - self.mean[:2])
        H = np.zeros((2, len(self.mean)))
        H[:, :2], H[:, 2], H[:, at : at + 2] = -Rt, (h[1], -h[0]), Rt
        return self.correct(z - h, H, R)

    def add(self, z, R):
        turned = self.rotation()
        o = turned @ z
        G = np.zeros((2, len(self.mean)))
        G[:, :2], G[:, 2] = np.eye(2), (-o[1], o[0])
        self.P = np.block([[self.P, self.P @ G.T], [G @ self.P, G @ self.P @ G.T + turned @ R @ turned.T]])
        self.mean = np.concatenate((self.mean, self.mean[:2] + o))

    def drop(self, k):
        last = len(self.mean) // 2 - 2
        keep = np.arange(len(self.mean))
        keep[3 + 2 * k : 5 + 2 * k] = 3 + 2 * last, 4 + 2 * last
        keep = keep[:-2]
        self.mean, self.P = self.mean[keep], self.P[np.ix_(keep, keep)]
