// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/graph/features.h>

#include <cstdint>
#include <string>
#include <vector>

namespace bundle_icp {

/** How ImageRetrieval describes whole images. */
struct BUNDLE_ICP_EXPORT RetrievalOptions {
  /** Number of words of the vocabulary, which is trained on the scan itself. */
  int vocabulary_size = 32;
  /** Number of descriptors that train the vocabulary. */
  int training_size = 8000;
  /** Threads to use, 0 = all. */
  int num_threads = 0;
  std::uint64_t seed = 0;

  bool
  isValid(std::string* error = nullptr) const;
};

/** Similarity of whole images: VLAD over RootSIFT (Jegou et al., CVPR 2010) with
 *  intra-normalisation (Arandjelovic, Zisserman, CVPR 2013). */
class BUNDLE_ICP_EXPORT ImageRetrieval {
public:
  /** Trains the vocabulary on descriptors drawn evenly from all frames. */
  explicit ImageRetrieval(const std::vector<const Features*>& frames,
                          const RetrievalOptions& options = {});

  /** Describes one more frame and gives it the next index. */
  void
  add(const Features& frame);

  /** Number of frames described so far. */
  std::size_t
  size() const
  {
    return descriptors_.size();
  }

  /** Cosine between the descriptors of two frames: 1 = same, about 0 = unrelated. */
  float
  similarity(std::size_t i, std::size_t j) const
  {
    return descriptors_[i].dot(descriptors_[j]);
  }

  /** The `count` frames of `among` most similar to `query`, best first, without `query`. */
  std::vector<std::size_t>
  mostSimilar(std::size_t query, const std::vector<std::size_t>& among, std::size_t count) const;

  /** Typical similarity of frames that show the same place in this scan: the median, over up to 100
   *  frames drawn evenly, of each frame's similarity to its most similar frame. Camera noise lowers
   *  it together with all other similarities. 0 for fewer than two frames. */
  float
  typicalSimilarity() const;

  /** An ascending subset: each frame is at least `similarity` alike to a frame of the subset. The
   *  greedy k-centre choice (Gonzalez 1985), starting with frame `first`. */
  std::vector<std::size_t>
  cover(std::size_t first, double similarity) const;

private:
  Eigen::VectorXf
  describe(const Features& frame) const;

  RetrievalOptions options_;
  Eigen::MatrixXf vocabulary_; ///< 128 x words
  std::vector<Eigen::VectorXf> descriptors_;
};

} // namespace bundle_icp
