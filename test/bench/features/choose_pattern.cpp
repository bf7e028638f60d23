// Prints the table of src/features/sampling_pattern.cpp: 256 pixel pairs for binary descriptors.
//
// The patch is taken as a Gaussian random field with an exponential covariance (natural images),
// seen in the direction of its intensity centroid: given m01 = 0 and m10 > 0. From this follow, for
// every pair of pixels, the probability of a set bit and its correlation with every other pair's,
// in closed form, so that no training images are needed. Candidates are drawn at random; those
// with the most balanced bits are taken first, and each must be little correlated with all taken
// before (the greedy choice of Rublee et al., ICCV 2011, section 4.3, on the model instead of on
// images).
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <vector>

namespace {

constexpr int kRadius = 15;
constexpr int kPairs = 256;

struct Candidate {
  int ua, va, ub, vb;
  double sigma;      // of the difference, given the direction
  double c10, c01;   // covariances with the normalised moments
  double imbalance;  // |mean| / sigma
};

double g_length_px = 10.0;

double covariance(double du, double dv) {
  return std::exp(-std::sqrt(du * du + dv * dv + 4.0) / g_length_px);
}

double covariance(const Candidate& i, const Candidate& j) {
  return covariance(i.ua - j.ua, i.va - j.va) - covariance(i.ua - j.ub, i.va - j.vb) -
         covariance(i.ub - j.ua, i.vb - j.va) + covariance(i.ub - j.ub, i.vb - j.vb);
}

/// Covariance of the pixel at (u, v) with the moments m10 and m01 of the disc.
struct Moments {
  double field10[2 * kRadius + 1][2 * kRadius + 1] = {};
  double variance = 0.0;  // of m10, and by symmetry of m01

  Moments() {
    for (int v = -kRadius; v <= kRadius; ++v)
      for (int u = -kRadius; u <= kRadius; ++u) {
        double& sum = field10[v + kRadius][u + kRadius];
        for (int y = -kRadius; y <= kRadius; ++y)
          for (int x = -kRadius; x <= kRadius; ++x)
            if (x * x + y * y <= kRadius * kRadius) sum += x * covariance(u - x, v - y);
        if (u * u + v * v <= kRadius * kRadius) variance += u * sum;
      }
  }
  [[nodiscard]] double with10(int u, int v) const { return field10[v + kRadius][u + kRadius]; }
  [[nodiscard]] double with01(int u, int v) const { return field10[u + kRadius][v + kRadius]; }
};

/// The variance that a moment keeps: m01 is zero; m10 is positive, half normal.
constexpr double kLost10 = 2.0 / 3.14159265358979;

double conditional(const Candidate& i, const Candidate& j) {
  return covariance(i, j) - i.c01 * j.c01 - kLost10 * i.c10 * j.c10;
}

std::vector<Candidate> draw(std::size_t count, double spread_px, const Moments& moments) {
  std::mt19937 random(20);
  std::normal_distribution<double> normal(0.0, spread_px);
  const double norm = std::sqrt(moments.variance);
  std::vector<Candidate> candidates;
  while (candidates.size() < count) {
    Candidate c{};
    const auto draw_pixel = [&](int& u, int& v) {
      do {
        u = static_cast<int>(std::lround(normal(random)));
        v = static_cast<int>(std::lround(normal(random)));
      } while (u * u + v * v > kRadius * kRadius);
    };
    draw_pixel(c.ua, c.va);
    draw_pixel(c.ub, c.vb);
    if (c.ua == c.ub && c.va == c.vb) continue;
    c.c10 = (moments.with10(c.ua, c.va) - moments.with10(c.ub, c.vb)) / norm;
    c.c01 = (moments.with01(c.ua, c.va) - moments.with01(c.ub, c.vb)) / norm;
    c.sigma = std::sqrt(conditional(c, c));
    c.imbalance = std::abs(c.c10) * std::sqrt(kLost10) / c.sigma;
    candidates.push_back(c);
  }
  return candidates;
}

}  // namespace

int main(int argc, char** argv) {
  const double spread_px = argc > 1 ? std::atof(argv[1]) : 6.0;
  if (argc > 2) g_length_px = std::atof(argv[2]);
  const double min_sigma = argc > 3 ? std::atof(argv[3]) : 0.7;
  const Moments moments;
  auto candidates = draw(40000, spread_px, moments);
  std::erase_if(candidates, [&](const Candidate& c) { return c.sigma < min_sigma; });
  std::stable_sort(candidates.begin(), candidates.end(), [](const auto& a, const auto& b) {
    return a.imbalance < b.imbalance;
  });
  std::vector<Candidate> chosen;
  double limit = 0.1;
  for (; chosen.size() < kPairs; limit += 0.02) {
    chosen.clear();
    for (const Candidate& c : candidates) {
      const bool distinct = std::all_of(chosen.begin(), chosen.end(), [&](const Candidate& other) {
        return std::abs(conditional(c, other)) < limit * c.sigma * other.sigma;
      });
      if (distinct) chosen.push_back(c);
      if (chosen.size() == kPairs) break;
    }
  }
  double worst = 0.0;
  for (const Candidate& c : chosen) worst = std::max(worst, c.imbalance);
  std::fprintf(stderr, "correlation below %.2f, |mean| / sigma below %.2f\n", limit, worst);
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    const Candidate& c = chosen[i];
    std::printf("{%d, %d, %d, %d},%s", c.ua, c.va, c.ub, c.vb, i % 4 == 3 ? "\n" : " ");
  }
  return 0;
}
