// Threads that are joined whatever happens, and that begin all or not at all.
#pragma once

#include <stdexcept>
#include <string>
#include <system_error>
#include <thread>
#include <vector>

namespace hexapod {

class ThreadTeam {
 public:
  ThreadTeam() = default;
  ThreadTeam(const ThreadTeam&) = delete;
  ThreadTeam& operator=(const ThreadTeam&) = delete;
  ~ThreadTeam() { join(); }

  // Throws std::runtime_error where the system refuses one; those that have begun are for `join`.
  template <class Work>
  void begin(int threads, const Work& work) {
    for (int k = 0; k < threads; ++k) {
      try {
        threads_.emplace_back(work);
      } catch (const std::exception& refusal) {
        throw std::runtime_error("the system has started " + std::to_string(k) + " of " +
                                 std::to_string(threads) + " threads: " + refusal.what());
      }
    }
  }

  void join() {
    for (std::thread& thread : threads_) thread.join();
    threads_.clear();
  }

 private:
  std::vector<std::thread> threads_;
};

}  // namespace hexapod
