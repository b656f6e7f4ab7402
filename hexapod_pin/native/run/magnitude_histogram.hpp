// Time spent at magnitudes, in bins that follow a double's own exponent and top mantissa bits: 64 per
// octave, so that a bin is at most 1/64 of its value wide. Only octaves that have been seen take memory.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <vector>

namespace hexapod {

class MagnitudeHistogram {
 public:
  MagnitudeHistogram() : octaves_(kOctaves) {}

  // `magnitude` >= 0, held for a time `weight`.
  void add(double magnitude, double weight) {
    const int bin = bin_of(magnitude);
    auto& octave = octaves_[std::size_t(bin >> kTopBits)];
    if (octave.empty()) octave.assign(kPerOctave, 0.0);
    octave[std::size_t(bin & (kPerOctave - 1))] += weight;
  }

  // Takes over what another one holds, and empties it.
  void take(MagnitudeHistogram& other) {
    for (std::size_t k = 0; k < octaves_.size(); ++k) {
      auto &mine = octaves_[k], &theirs = other.octaves_[k];
      if (theirs.empty()) continue;
      if (mine.empty()) mine.assign(kPerOctave, 0.0);
      for (std::size_t part = 0; part < kPerOctave; ++part) mine[part] += theirs[part];
      std::fill(theirs.begin(), theirs.end(), 0.0);
    }
  }

  // The magnitude not exceeded for this share of the time, interpolated in its bin; 0 when empty.
  double quantile(double share) const {
    double total = 0.0, end = 0.0;  // end: of the last bin in use
    for_each_bin([&](int, double w) { total += w; });
    double left = share * total, found = -1.0;
    for_each_bin([&](int bin, double w) {
      if (found >= 0.0 || w == 0.0) return;
      end = lower(bin + 1);
      if (left <= w) found = lower(bin) + (end - lower(bin)) * left / w;
      left -= w;
    });
    return found >= 0.0 ? found : end;
  }

 private:
  static constexpr int kTopBits = 6, kPerOctave = 1 << kTopBits;
  static constexpr int kLowestExponent = -44, kOctaves = 104;  // 6e-14 to 1e18; smaller: as 0
  static constexpr std::int64_t kBias = 1023;                  // of a double's exponent

  template <class Visit>
  void for_each_bin(Visit visit) const {
    for (std::size_t k = 0; k < octaves_.size(); ++k)
      for (std::size_t part = 0; part < octaves_[k].size(); ++part)
        visit(int(k) * kPerOctave + int(part), octaves_[k][part]);
  }

  static int bin_of(double magnitude) {
    std::int64_t bits;
    std::memcpy(&bits, &magnitude, sizeof bits);
    const std::int64_t key = (bits >> (52 - kTopBits)) - (kBias + kLowestExponent) * kPerOctave;
    return int(std::clamp<std::int64_t>(key, 0, kOctaves * kPerOctave - 1));
  }

  static double lower(int bin) {  // bin 0 begins at 0
    if (bin <= 0) return 0.0;
    return std::ldexp(1.0 + double(bin % kPerOctave) / kPerOctave,
                      kLowestExponent + bin / kPerOctave);
  }

  std::vector<std::vector<double>> octaves_;  // s
};

}  // namespace hexapod
