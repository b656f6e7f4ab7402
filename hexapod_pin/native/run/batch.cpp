#include "run/batch.hpp"

#include <algorithm>
#include <system_error>

namespace hexapod {

Batch::Batch(int threads) {
  pool_.reserve(std::size_t(std::max(threads, 1)));
  try {
    for (int k = 1; k < threads; ++k) pool_.emplace_back([this] { work(false); });
  } catch (const std::system_error&) {  // no more threads to be had: those that started will do
  }
}

Batch::~Batch() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  for (std::thread& thread : pool_) thread.join();
}

void Batch::add(Rollout* rollout, long samples) {
  rollout->samples().reserve(std::size_t(std::max(samples, 0L)));
  auto job = std::make_unique<Job>();
  job->rollout = rollout;
  job->left = samples;
  job->slice = std::clamp(samples / kSlices, kShortestSlice, kLongestSlice);
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    jobs_.push_back(std::move(job));
  }
  changed_.notify_one();
}

std::vector<bool> Batch::finish() {
  work(true);
  std::vector<bool> good;
  for (const auto& job : jobs_) {
    if (job->failure) std::rethrow_exception(job->failure);
    good.push_back(job->good);
  }
  return good;
}

Batch::Job* Batch::next_job() {
  Job* longest = nullptr;
  for (const auto& job : jobs_)
    if (!job->running && job->left > 0 && (longest == nullptr || job->left > longest->left))
      longest = job.get();
  return longest;
}

void Batch::advance(Job& job, std::unique_lock<std::mutex>& lock) {
  const long samples = std::min(job.slice, job.left);
  job.running = true;
  lock.unlock();
  bool good = false;
  std::exception_ptr failure;
  try {
    good = job.rollout->advance(samples);
  } catch (...) {
    failure = std::current_exception();
  }
  lock.lock();
  job.running = false;
  job.good = good;
  job.failure = failure;
  job.left = good ? job.left - samples : 0;
}

// The pool's threads wait for more; the caller of `finish` leaves when all is done.
void Batch::work(bool leave_when_idle) {
  std::unique_lock<std::mutex> lock(mutex_);
  while (!stopping_) {
    if (Job* job = next_job()) {
      advance(*job, lock);
      if (job->left <= 0) changed_.notify_all();  // else this thread takes what it has left
      continue;
    }
    const auto done = [](const auto& job) { return !job->running && job->left <= 0; };
    if (leave_when_idle && std::all_of(jobs_.begin(), jobs_.end(), done)) return;
    changed_.wait(lock);
  }
}

}  // namespace hexapod
