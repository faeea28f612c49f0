/// \file
/// The residuals of a plant over its records, as a solver sees them. Shared by the fits of this folder.
#pragma once

#include <vector>

#include "core/greybox/plant_fit.hpp"

namespace wheelhop {

/// The records as far as their initial states are seen in them: what is fitted to find nothing else.
std::vector<FitRecord> remembered_part(const Plant& plant, std::vector<FitRecord> records);

/// Adds theta * scale to parameters of a plant. False where one would leave its bounds by more than rounding.
bool move_parameters(Plant& plant, const std::vector<FitParameter>& parameters, ConstVectorRef theta);

/// r(theta) = (simulated - measured) / weight_std over the scored samples of all records; theta holds the parameters,
/// then the initial state of each record, all in their scales. A Jacobian is stored by blocks: columns of the
/// parameters, then those of a record's own initial state.
class PlantProblem final : public ResidualProblem {
 public:
  /// @param state_scale of [q; v]   @param memory_scale of the inner states; empty: they rest where a record begins
  PlantProblem(const Plant& plant, const std::vector<FitParameter>& parameters, const std::vector<FitRecord>& records,
               ConstVectorRef state_scale, const Vector& memory_scale = {});

  /// Nothing else runs beside: columns of a Jacobian are shared out over the threads, for more work in all.
  void run_alone() { alone_ = true; }

  /// Derivatives that the first Jacobian asked for at `theta` takes from another fit instead of computing them.
  void start_from(const PlantFit& other, ConstVectorRef theta) {
    other_ = &other;
    other_theta_ = theta;
  }

  Index moved() const { return static_cast<Index>(parameters_.size()); }
  Index states() const { return state_scale_.size(); }
  Index parameters() const override { return moved() + states() * static_cast<Index>(records_.size()); }
  Index residuals() const override { return residuals_; }
  Box box() const override { return box_; }
  BlockAngular layout() const override;

  bool residual(ConstVectorRef theta, VectorRef r) const override;
  bool jacobian(ConstVectorRef theta, VectorRef r, MatrixRef J) const override;
  bool stored_jacobian(ConstVectorRef theta, VectorRef r, MatrixRef J) const override;
  /// Columns of the only record's Jacobian, so many at a time.
  bool columns(ConstVectorRef theta, Index at_once, VectorRef r, const PutColumn& put) const;

  /// The plant at theta. False where a parameter leaves its bounds, or a mass is none.
  bool place(ConstVectorRef theta, Plant& plant) const;
  InitialState initial_state(ConstVectorRef theta, std::size_t record) const;

 private:
  Index length(std::size_t i) const { return records_[i].y.rows() * (records_[i].y.cols() - records_[i].skip); }
  bool run(const Plant& plant, ConstVectorRef theta, std::size_t i, VectorRef r) const;
  bool known_column(Index j, MatrixRef J) const;
  bool neighbour(ConstVectorRef theta, Index j, double step, Plant& plant) const;
  bool vary(const Plant& plant, ConstVectorRef theta, std::size_t i, const std::vector<Index>& columns, VectorRef r,
            const PutColumn& put) const;

  Plant plant_;
  std::vector<FitParameter> parameters_;
  std::vector<FitRecord> records_;
  Vector state_scale_;                     // of [q; v], then of the inner states
  Index motions_ = 0;                      // of these, [q; v]
  std::vector<std::string> memory_names_;  // of those that are free
  Index laws_memories_ = 0;                // of these, those of laws
  Box box_;
  double memory_s_ = 0;
  std::vector<Index> first_;
  Index residuals_ = 0;
  bool alone_ = false;
  const PlantFit* other_ = nullptr;
  Vector other_theta_;
};

}  // namespace wheelhop
